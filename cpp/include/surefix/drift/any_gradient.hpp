// The gradient of a linear system's likelihood, for sizes known at run time.
#pragma once

#include <memory>

#include "surefix/core/linear_system.hpp"

namespace surefix::drift {

class AnyGradient {
 public:
  virtual ~AnyGradient() = default;

  [[nodiscard]] static ConfigStatus make(const LinearSystem& system,
                                         std::unique_ptr<AnyGradient>& out);
  /// `likelihood_gradient` of z (T, m), finite, with inputs (T − 1, n) or null, into `out` (T, m).
  [[nodiscard]] virtual Status run(const double* z, int T, const double* inputs,
                                   double* out) const = 0;
  [[nodiscard]] virtual int size() const noexcept = 0;
  [[nodiscard]] virtual int measured() const noexcept = 0;
  /// Measurements that its matrices are for; 0: any number.
  [[nodiscard]] virtual int steps() const noexcept = 0;
};

}  // namespace surefix::drift
