#include "tools/view/web/pages.h"
namespace overtake::cli {
static const unsigned char kIndex[] = {31,139,8,0,239,190,3,107,2,255,179,201,40,201,205,177,203,200,180,209,7,51,0,144,221,94,181,15,0,0,0};
static const Page kPages[] = {{"/index.html", "text/html", kIndex, sizeof kIndex}};
std::span<const Page> pages() { return kPages; }
}
