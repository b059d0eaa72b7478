// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/python/frame.h"

#include <pthread.h>
#include <pybind11/numpy.h>

#include <atomic>

namespace overtake::python {
namespace {

std::atomic<int32_t> forks{0};

struct Detections {
  std::shared_ptr<FrameHold> hold;
  ovt_detections rows;
};
struct Clusters {
  std::shared_ptr<FrameHold> hold;
  ovt_clusters rows;
};
struct Labels {
  std::shared_ptr<FrameHold> hold;
  ovt_labels rows;
};
struct Tracks {
  std::shared_ptr<FrameHold> hold;
  std::shared_ptr<const TracksCopy> copy;
  const ovt_tracks& rows() const { return copy->rows; }
};

struct PyFrame {
  std::shared_ptr<FrameHold> hold;
  ovt_frame_info info;
  int64_t number;
};

// ---- arrays ---------------------------------------------------------------------------------------------------------

// What keeps an array's memory: the frame's source. Memory of its own (tracks, unpacked bits) keeps a live frame, too,
// so that all arrays of a frame have one rule; that of a copied frame is kept alone, because such frames are many.
std::shared_ptr<const void> keep(const std::shared_ptr<FrameSource>& source, std::shared_ptr<const void> memory) {
  if (!source->is_live()) return memory;
  using Both = std::pair<std::shared_ptr<const void>, std::shared_ptr<const void>>;
  return std::make_shared<const Both>(source, std::move(memory));
}
template <class Table>
std::shared_ptr<const void> owner_of(const Table& table) {
  return table.hold->get();
}
std::shared_ptr<const void> owner_of(const Tracks& table) { return keep(table.hold->get(), table.copy); }

py::array make_array(const std::shared_ptr<const void>& owner, const py::dtype& type, const void* data,
                     const std::vector<py::ssize_t>& shape, const std::vector<py::ssize_t>& strides = {}) {
  const py::capsule base(new std::shared_ptr<const void>(owner),
                         [](void* kept) { delete static_cast<std::shared_ptr<const void>*>(kept); });
  py::array array(type, shape, strides, data, base);
  py::detail::array_proxy(array.ptr())->flags &= ~py::detail::npy_api::NPY_ARRAY_WRITEABLE_;
  return array;
}

template <class T, class Table>
py::object column(const Table& table, const T* data, const std::vector<py::ssize_t>& shape) {
  const std::shared_ptr<const void> owner = owner_of(table);  // raises where the frame was released
  if (!data) return py::none();                               // the preset does not compute it
  return make_array(owner, py::dtype::of<T>(), data, shape);
}

// ---- docstrings -----------------------------------------------------------------------------------------------------

std::string unit_of(std::string name) {
  static constexpr const char* kUnits[][2] = {{"_mps", "m/s"},  {"_rps", "rad/s"}, {"_rad", "rad"},
                                              {"_ns", "ns"},    {"_m", "m"},       {"_s", "s"},
                                              {"var_x", "m^2"}, {"var_y", "m^2"},  {"cov_xy", "m^2"}};
  for (const auto& [ending, unit] : kUnits)
    if (name.ends_with(ending)) return unit;
  return "";
}

template <class T>
std::string doc(const std::string& name, const std::string& shape, const std::string& meaning,
                const std::string& words = "", bool optional = false) {
  std::string text = py::cast<std::string>(py::str(py::dtype::of<T>())) + " " + shape;
  if (const std::string unit = unit_of(name); !unit.empty()) text += ", " + unit;
  text += ": " + meaning;
  if (!words.empty()) {
    text += ". Values:";
    int value = 0;
    for (std::size_t at = 0; at < words.size(); ++value) {
      const std::size_t end = std::min(words.find(' ', at), words.size());
      text += (value > 0 ? ", " : " ") + std::to_string(value) + " " + words.substr(at, end - at);
      at = end + 1;
    }
  }
  return text + (optional ? ". None with preset paper" : "") + ".";
}

// ---- tables ---------------------------------------------------------------------------------------------------------

template <class Table>
py::dict to_dict(const py::object& self, const std::vector<const char*>& names) {
  py::dict out;
  for (const char* name : names) {
    const py::object value = self.attr(name);
    if (!value.is_none()) out[name] = value.attr("copy")();
  }
  return out;
}

// A data frame of the columns with one value per row.
py::object to_pandas(const py::dict& columns, py::ssize_t count) {
  py::dict flat;
  for (const auto& [name, value] : columns) {
    const auto array = py::reinterpret_borrow<py::array>(value);
    if (array.ndim() == 1 && array.shape(0) == count) flat[name] = array;
  }
  return py::module_::import("pandas").attr("DataFrame")(flat);
}

template <class Table, class Count>
void add_common(py::class_<Table>& type, const char* name, std::vector<const char*> names, Count count) {
  type.def("__len__", count);
  type.def("__repr__", [=](const Table& table) {
    return "<overtake." + std::string(name) + ": " + std::to_string(count(table)) + " rows>";
  });
  type.def(
      "to_dict", [=](const py::object& self) { return to_dict<Table>(self, names); },
      "Copies of all columns, by name; they do not hold the frame.");
  type.def(
      "to_pandas",
      [=](const py::object& self) {
        return to_pandas(to_dict<Table>(self, names), py::ssize_t(count(self.cast<const Table&>())));
      },
      "A pandas.DataFrame of the columns with one value per row (needs pandas).");
  py::list list;
  for (const char* column_name : names) list.append(column_name);
  type.attr("columns") = py::tuple(list);
}

void add_detections(py::module_& module) {
  py::class_<Detections> type(module, "Detections",
                              "Detected objects: columns of len(detections) rows, vehicle frame at each row's stamp.");
  std::vector<const char*> names;
#define OVT_ADD(type_, name, meaning, words, optional)                                                       \
  names.push_back(#name);                                                                                    \
  type.def_property_readonly(                                                                                \
      #name, [](const Detections& t) { return column<type_>(t, t.rows.name, {py::ssize_t(t.rows.count)}); }, \
      doc<type_>(#name, "(n,)", meaning, words, optional).c_str());
#define OVT_DETECTION(type_, name, csv, json, words, meaning) OVT_ADD(type_, name, meaning, words, false)
#define OVT_DETECTION_TRACK(type_, name, csv, json, words, meaning) OVT_ADD(type_, name, meaning, words, false)
#define OVT_DETECTION_VIEW(type_, name, csv, json, words, meaning) OVT_ADD(type_, name, meaning, words, true)
#include "core/columns.def"
#undef OVT_ADD
  add_common(type, "Detections", names, [](const Detections& t) { return t.rows.count; });
}

void add_clusters(py::module_& module) {
  py::class_<Clusters> type(module, "Clusters",
                            "Merged clusters before any gate: columns of len(clusters) rows, vehicle frame.");
  std::vector<const char*> names;
#define OVT_CLUSTER(type_, name, meaning)                                                                  \
  names.push_back(#name);                                                                                  \
  type.def_property_readonly(                                                                              \
      #name, [](const Clusters& t) { return column<type_>(t, t.rows.name, {py::ssize_t(t.rows.count)}); }, \
      doc<type_>(#name, "(n,)", meaning).c_str());
#include "core/columns.def"
  add_common(type, "Clusters", names, [](const Clusters& t) { return t.rows.count; });
}

void add_labels(py::module_& module) {
  py::class_<Labels> type(
      module, "Labels",
      "The points of one sensor's scan with their labels: columns of len(labels) rows, in the order "
      "of the push.");
  std::vector<const char*> names;
#define OVT_LABEL(type_, name, table, meaning)                                                           \
  names.push_back(#name);                                                                                \
  type.def_property_readonly(                                                                            \
      #name, [](const Labels& t) { return column<type_>(t, t.rows.name, {py::ssize_t(t.rows.count)}); }, \
      doc<type_>(#name, "(n,)", meaning).c_str());
#define OVT_LABEL_CLUSTER(type_, name, meaning)                                                                    \
  names.push_back(#name);                                                                                          \
  type.def_property_readonly(                                                                                      \
      #name, [](const Labels& t) { return column<type_>(t, t.rows.name, {py::ssize_t(t.rows.label_count) + 1}); }, \
      doc<type_>(#name, "(label_count + 1,)", meaning).c_str());
#define OVT_LABELS_VALUE(type_, name, meaning) \
  type.def_property_readonly(                  \
      #name, [](const Labels& t) { return t.rows.name; }, meaning);
#include "core/columns.def"
  add_common(type, "Labels", names, [](const Labels& t) { return t.rows.count; });
}

void add_tracks(py::module_& module) {
  py::class_<Tracks> type(
      module, "Tracks",
      "Tracked objects: columns of len(tracks) rows, in the frame of reference Frame.reference. "
      "They are a copy in the frame's memory, a few kB, because the library's reader has room for the "
      "tracks at one time only, and tracks_at() would change them.");
  std::vector<const char*> names;
#define OVT_ADD(type_, name, meaning, words, optional)                                                       \
  names.push_back(#name);                                                                                    \
  type.def_property_readonly(                                                                                \
      #name, [](const Tracks& t) { return column<type_>(t, t.rows().name, {py::ssize_t(t.rows().count)}); }, \
      doc<type_>(#name, "(n,)", meaning, words, optional).c_str());
#define OVT_TRACK(type_, name, csv, json, words, meaning) OVT_ADD(type_, name, meaning, words, false)
#define OVT_TRACK_OPTIONAL(type_, name, csv, json, words, meaning) OVT_ADD(type_, name, meaning, words, true)
#define OVT_ADD_PATH(type_, name, meaning, optional)                                                               \
  names.push_back("path_" #name);                                                                                  \
  type.def_property_readonly(                                                                                      \
      "path_" #name,                                                                                               \
      [](const Tracks& t) {                                                                                        \
        return column<type_>(t, t.rows().path_##name,                                                              \
                             {py::ssize_t(t.rows().count), py::ssize_t(t.rows().path_points)});                    \
      },                                                                                                           \
      doc<type_>(#name, "(n, path_points)", std::string(meaning) + ", (k + 1) * path_step_s after publish_ns", "", \
                 optional)                                                                                         \
          .c_str());
#define OVT_PATH(type_, name, json, meaning) OVT_ADD_PATH(type_, name, meaning, false)
#define OVT_PATH_OPTIONAL(type_, name, json, meaning) OVT_ADD_PATH(type_, name, meaning, true)
#define OVT_TRACKS_VALUE(type_, name, json, meaning) \
  type.def_property_readonly(                        \
      #name, [](const Tracks& t) { return t.rows().name; }, meaning);
#include "core/columns.def"
#undef OVT_ADD
#undef OVT_ADD_PATH
  names.push_back("covariance");
  type.def_property_readonly(
      "covariance",
      [](const Tracks& t) {
        return column<double>(t, t.copy->covariance, {py::ssize_t(t.rows().count), 5, 5});
      },
      "float64 (n, 5, 5): covariance of x_m, y_m, speed_mps, course_rad, yaw_rate_rps. Symmetric; the library has the "
      "lower triangle, as columns.");
  add_common(type, "Tracks", names, [](const Tracks& t) { return t.rows().count; });
}

// ---- frames ---------------------------------------------------------------------------------------------------------

int32_t index_of(const PyFrame& frame, const py::object& sensor) { return sensor_index(*frame.hold->sensors, sensor); }

std::string about(const PyFrame& frame, int32_t sensor, const std::string& what) {
  return what + " of sensor '" + (*frame.hold->sensors)[std::size_t(sensor)] + "' in frame " +
         std::to_string(frame.info.sequence);
}

Tracks read_tracks(const PyFrame& frame, int64_t publish_ns) {
  Tracks table{frame.hold, nullptr};
  const ovt_status status = frame.hold->get()->read_tracks(publish_ns, table.copy);
  if (status == OVT_NOT_KEPT)
    throw StatusError(status, "this frame is a copy: it has the tracks at its stamp only (Frame.tracks)");
  check(status, "tracks");
  return table;
}

Labels read_labels(const PyFrame& frame, const py::object& sensor) {
  Labels table{frame.hold, {}};
  const int32_t index = index_of(frame, sensor);
  const ovt_status status = frame.hold->get()->read_labels(index, table.rows);
  if (status == OVT_NOT_KEPT)
    throw StatusError(status, about(frame, index, "the labels") + " were not copied: pass copy_labels=True");
  check(status, about(frame, index, "labels"));
  return table;
}

// Bits as bool: NumPy has no type for bits.
py::array unpack_bits(const std::shared_ptr<FrameSource>& source, const ovt_image& image) {
  const auto memory = std::make_shared<Columns>();
  const auto rows = std::size_t(image.rows), cols = std::size_t(image.cols);
  bool* out = memory->make<bool>(rows * cols);
  {
    const py::gil_scoped_release release;
    for (std::size_t r = 0; r < rows; ++r) {
      const auto* words =
          reinterpret_cast<const uint64_t*>(static_cast<const char*>(image.data) + r * std::size_t(image.stride_bytes));
      for (std::size_t c = 0; c < cols; ++c) out[r * cols + c] = (words[c / 64] >> (c % 64)) & 1;
    }
  }
  return make_array(keep(source, memory), py::dtype::of<bool>(), out, {image.rows, image.cols});
}

py::array read_image(const PyFrame& frame, const std::string& name, const py::object& sensor) {
  const std::shared_ptr<FrameSource> source = frame.hold->get();
  const int32_t index = index_of(frame, sensor);
  std::string names;
  for (int32_t id = 0; id < OVT_IMAGE_COUNT; ++id) {
    names += (id > 0 ? ", " : "") + std::string(ovt_image_name(id));
    if (name != ovt_image_name(id)) continue;
    ovt_image image;
    const ovt_status status = source->read_image(index, ovt_image_id(id), image);
    if (status == OVT_NOT_KEPT)
      throw StatusError(status, about(frame, index, "image '" + name + "'") +
                                    " was not kept: pass keep_images=True to Detector, or copy_images=True to run");
    check(status, about(frame, index, "image '" + name + "'"));
    if (image.type == OVT_IMAGE_BITS) return unpack_bits(source, image);
    const py::dtype type = image.type == OVT_IMAGE_F32 ? py::dtype::of<float>() : py::dtype::of<int32_t>();
    return make_array(source, type, image.data, {image.rows, image.cols}, {py::ssize_t(image.stride_bytes), 4});
  }
  throw StatusError(OVT_UNKNOWN_NAME, "there is no image '" + name + "' (there are: " + names + ")");
}

py::dict read_times(const PyFrame& frame, const py::object& sensor) {
  const std::shared_ptr<FrameSource> source = frame.hold->get();
  const int32_t index = sensor.is_none() ? -1 : index_of(frame, sensor);
  py::dict out;
  for (int32_t stage = 0; stage < OVT_STAGE_COUNT; ++stage) {
    ovt_span span;
    if (source->read_span(index, ovt_stage(stage), span) == OVT_OK && span.duration_ns >= 0)
      out[ovt_stage_name(stage)] = span.duration_ns;
  }
  return out;
}

template <class T>
py::object info_value(const char* name, T value) {
  const std::string text = name;
  if (text == "flags") return flags_object(uint32_t(value));
  if (text == "ego_known") return py::bool_(value != T(0));
  return py::cast(value);
}

void add_frame(py::module_& module) {
  py::class_<PyFrame> type(module, "Frame", R"(One finished frame: what the detector found in one sweep of the sensors.

Its tables have NumPy arrays of read-only columns over the frame's memory: the library's own, or for tracks and images
of bits a copy that belongs to the frame. All arrays and tables hold the frame: its memory is reused only when all of
them are gone. A detector has frame_capacity frames to give. After release() the frame and its tables raise
ReleasedError; arrays taken before stay valid, and hold the memory until they die. A frame of overtake.run, or of a
detector with every_frame, owns copies and holds nothing of the detector.)");
#define OVT_FRAME_VALUE(type_, name, meaning) \
  type.def_property_readonly(                 \
      #name, [](const PyFrame& f) { return info_value(#name, f.info.name); }, meaning);
#define OVT_FRAME_OPTIONAL OVT_FRAME_VALUE
#define OVT_FRAME_TIME OVT_FRAME_VALUE
#include "pipeline/stats.def"
  type.def_property_readonly(
      "number", [](const PyFrame& frame) { return frame.number; },
      "Number of the frame in its recording; of a detector's frame: sequence.");
  type.def_property_readonly(
      "sensors",
      [](const PyFrame& frame) {
        py::list names;
        for (std::size_t s = 0; s < frame.hold->sensors->size(); ++s)
          if (frame.info.sensor_mask >> s & 1) names.append((*frame.hold->sensors)[s]);
        return names;
      },
      "Names of the sensors whose scans this frame has.");
  type.def_property_readonly(
      "detections",
      [](const PyFrame& frame) {
        Detections table{frame.hold, {}};
        check(frame.hold->get()->read_detections(table.rows), "detections");
        return table;
      },
      "Detections of this frame.");
  type.def_property_readonly(
      "tracks", [](const PyFrame& frame) { return read_tracks(frame, OVT_AT_FRAME_STAMP); },
      "Tracks after this frame, at tracks_stamp_ns.");
  type.def("tracks_at", &read_tracks, py::arg("publish_ns"),
           "Tracks after this frame, predicted to publish_ns, at most 59 s ahead. Only of a frame that is no copy.");
  type.def_property_readonly(
      "clusters",
      [](const PyFrame& frame) {
        Clusters table{frame.hold, {}};
        check(frame.hold->get()->read_clusters(table.rows), "clusters");
        return table;
      },
      "Merged clusters of this frame.");
  type.def("labels", &read_labels, py::arg("sensor") = 0, "Points and labels of one sensor (name or index).");
  type.def(
      "image", &read_image, py::arg("name"), py::arg("sensor") = 0,
      "Image (rows, cols) of one sensor: float32 (m or rad), int32, or bool for images of bits. "
      "overtake.image_names lists the names. Images of bits are copies in the frame's memory, a byte for each bit, "
      "because NumPy has no type for bits.");
  type.def("times", &read_times, py::arg("sensor") = py::none(),
           "Nanoseconds of each stage that ran: of the whole frame, or of one sensor (name or index).");
  type.def(
      "release", [](PyFrame& frame) { frame.hold->source.reset(); },
      "Gives the frame up: it and its tables raise ReleasedError from now on. Its memory is reused when no array of it "
      "is left.");
  type.def_property_readonly(
      "released", [](const PyFrame& frame) { return !frame.hold->source; }, "Whether release() was called.");
  type.def("__enter__", [](py::object self) { return self; });
  type.def("__exit__", [](PyFrame& frame, const py::args&) { frame.hold->source.reset(); });
  type.def("__repr__", [](const PyFrame& frame) {
    return "<overtake.Frame " + std::to_string(frame.info.sequence) + ": " +
           std::to_string(frame.info.detection_count) + " detections, " + std::to_string(frame.info.track_count) +
           " tracks" + (frame.hold->source ? ">" : ", released>");
  });
}

}  // namespace

int32_t fork_count() { return forks.load(std::memory_order_relaxed); }

const std::shared_ptr<FrameSource>& FrameHold::get() const {
  if (!source) throw ReleasedError("this frame was released: take what you need before release()");
  if (forks != fork_count()) throw ReleasedError("this process was forked: the frame's memory is its parent's");
  return source;
}

int32_t sensor_index(const SensorNames& names, py::handle sensor) {
  const auto list = [&] {
    std::string text;
    for (const std::string& name : names) text += (text.empty() ? "'" : ", '") + name + "'";
    return names.empty() ? std::string("none") : text;
  };
  if (py::isinstance<py::str>(sensor)) {
    const auto name = py::cast<std::string>(sensor);
    for (std::size_t i = 0; i < names.size(); ++i)
      if (names[i] == name) return int32_t(i);
    throw StatusError(OVT_UNKNOWN_NAME, "there is no sensor '" + name + "' (there is: " + list() + ")");
  }
  const auto index = to_number<int64_t>(sensor, "sensor");
  if (index < 0 || index >= int64_t(names.size()))
    throw StatusError(OVT_UNKNOWN_NAME, "there is no sensor " + std::to_string(index) + " (there are " +
                                            std::to_string(names.size()) + ": " + list() + ")");
  return int32_t(index);
}

py::object make_frame(const ovt_frame_info& info, std::unique_ptr<FrameSource> source,
                      std::shared_ptr<const SensorNames> sensors, int64_t number) {
  auto hold = std::make_shared<FrameHold>();
  hold->source = std::move(source);
  hold->sensors = std::move(sensors);
  return py::cast(PyFrame{std::move(hold), info, number});
}

void add_frames(py::module_& module) {
  pthread_atfork(nullptr, nullptr, [] { forks.fetch_add(1, std::memory_order_relaxed); });
  add_detections(module);
  add_clusters(module);
  add_labels(module);
  add_tracks(module);
  add_frame(module);
  py::list images, stages, reasons;
  for (int32_t i = 0; ovt_image_name(i); ++i) images.append(ovt_image_name(i));
  for (int32_t i = 0; ovt_stage_name(i); ++i) stages.append(ovt_stage_name(i));
  for (int32_t i = 0; ovt_reason_name(i); ++i) reasons.append(ovt_reason_name(i));
  module.attr("image_names") = py::tuple(images);
  module.attr("stage_names") = py::tuple(stages);
  module.attr("reason_names") = py::tuple(reasons);
}

}  // namespace overtake::python
