#include "tools/evaluation/report.h"
namespace overtake::evaluation { void write_report(const std::string&, bool) {} }
