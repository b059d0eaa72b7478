// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Replaces malloc and its family, and mmap of memory, in this program. The one file that includes this header must
// first declare:
//   bool allow_request()              called before each request; false refuses it
//   void count_blocks(int change)     called after it: +1 a block was allocated, -1 one was freed; mapped memory: pages
// OVT_TEST_OWN_HEAP is 0, and nothing is defined, with a sanitizer, which brings its own heap, and without glibc.
//
// The blocks come from glibc, through the second names of its functions. The replacements have default visibility;
// otherwise the C++ library's operator new would not use them (the build hides symbols by default, clang also these).
#pragma once

#include <cerrno>
#include <cstddef>

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define OVT_TEST_OWN_HEAP 0
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer) || __has_feature(memory_sanitizer)
#define OVT_TEST_OWN_HEAP 0
#endif
#endif
#if !defined(OVT_TEST_OWN_HEAP)
#if defined(__GLIBC__)
#define OVT_TEST_OWN_HEAP 1
#else
#define OVT_TEST_OWN_HEAP 0
#endif
#endif

#if OVT_TEST_OWN_HEAP
#include <sys/mman.h>
#include <sys/syscall.h>
#include <unistd.h>

#pragma GCC visibility push(default)
extern "C" {
void* __libc_malloc(std::size_t bytes);
void* __libc_calloc(std::size_t count, std::size_t bytes);
void* __libc_realloc(void* block, std::size_t bytes);
void* __libc_memalign(std::size_t alignment, std::size_t bytes);
void __libc_free(void* block);

void* malloc(std::size_t bytes) {
  if (!allow_request()) return errno = ENOMEM, nullptr;
  void* block = __libc_malloc(bytes);
  if (block) count_blocks(1);
  return block;
}
void* calloc(std::size_t count, std::size_t bytes) {
  if (!allow_request()) return errno = ENOMEM, nullptr;
  void* block = __libc_calloc(count, bytes);
  if (block) count_blocks(1);
  return block;
}
void* realloc(void* block, std::size_t bytes) {
  if (!allow_request()) return errno = ENOMEM, nullptr;
  void* moved = __libc_realloc(block, bytes);
  if (!block && moved) count_blocks(1);
  if (block && bytes == 0) count_blocks(-1);
  return moved;
}
void* memalign(std::size_t alignment, std::size_t bytes) {
  if (!allow_request()) return errno = ENOMEM, nullptr;
  void* block = __libc_memalign(alignment, bytes);
  if (block) count_blocks(1);
  return block;
}
void* aligned_alloc(std::size_t alignment, std::size_t bytes) { return memalign(alignment, bytes); }
int posix_memalign(void** block, std::size_t alignment, std::size_t bytes) {
  *block = memalign(alignment, bytes);
  return *block ? 0 : ENOMEM;
}
void free(void* block) {
  if (block) count_blocks(-1);
  __libc_free(block);
}
// The C library's own mappings (of its heap, of stacks and of files) do not call this function.
void* mmap(void* address, std::size_t bytes, int protection, int flags, int file, off_t offset) noexcept {
  const bool is_memory = (flags & MAP_ANONYMOUS) && (protection & PROT_WRITE);
  if (is_memory && !allow_request()) return errno = ENOMEM, MAP_FAILED;
  const long at = syscall(SYS_mmap, address, bytes, protection, flags, file, offset);
  if (at != -1 && is_memory) count_blocks(int((bytes + 4095) / 4096));
  return reinterpret_cast<void*>(at);
}
int munmap(void* address, std::size_t bytes) noexcept {
  const int result = int(syscall(SYS_munmap, address, bytes));
  if (result == 0) count_blocks(-int((bytes + 4095) / 4096));
  return result;
}
}
#pragma GCC visibility pop
#endif
