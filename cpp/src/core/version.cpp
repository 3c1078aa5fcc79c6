#include "surefix/version.hpp"

#if defined(__clang__)
#define SUREFIX_COMPILER "clang " __clang_version__
#elif defined(__GNUC__)
#define SUREFIX_COMPILER "g++ " __VERSION__
#else
#define SUREFIX_COMPILER "unknown"
#endif

#define SUREFIX_TEXT_OF(x) #x
#define SUREFIX_TEXT(x) SUREFIX_TEXT_OF(x)
#define SUREFIX_EIGEN               \
  SUREFIX_TEXT(EIGEN_WORLD_VERSION) \
  "." SUREFIX_TEXT(EIGEN_MAJOR_VERSION) "." SUREFIX_TEXT(EIGEN_MINOR_VERSION)

namespace surefix {

BuildFacts build_facts() noexcept {
#if defined(__cpp_exceptions)
  constexpr bool exceptions = true;
#else
  constexpr bool exceptions = false;
#endif
  return {version,     SUREFIX_COMPILER,      SUREFIX_BUILD_TYPE, SUREFIX_EIGEN,
          __cplusplus, EIGEN_MAX_ALIGN_BYTES, exceptions};
}

}  // namespace surefix
