// The two filters that run a bank of modes.
#pragma once

#include <cstdint>

namespace surefix::switching {

/// What a mode starts a step from.
enum class Method : std::uint8_t {
  one_step,  ///< the merged estimate, the same for all modes
  imm,       ///< its own mixture of the modes before (17), (18)
};

}  // namespace surefix::switching
