// Failures name a status instead of printing its byte.
#pragma once

#include <ostream>

#include "surefix/core/status.hpp"

namespace surefix {

inline void PrintTo(Status status, std::ostream* out) { *out << name(status); }

}  // namespace surefix
