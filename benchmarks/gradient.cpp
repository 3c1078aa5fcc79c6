// W4 by hand: the gradient of the likelihood with respect to every measurement, two states, with
// Eigen's fixed sizes, as the paper writes it (Parellier, Barrau & Bonnabel 2023, (3)-(6),
// (20)-(22)).
#include <Eigen/Dense>
#include <vector>

namespace {

struct Step {
  double z, S;
  Eigen::Vector2d K;
};

void gradient(const double* y, std::size_t N, const Eigen::Matrix2d& F, const Eigen::Matrix2d& Q,
              double R, const Eigen::Vector2d& x0, const Eigen::Matrix2d& P0,
              std::vector<Step>& kept, double* out) {
  const Eigen::RowVector2d H(1.0, 0.0);
  Eigen::Vector2d x = x0;
  Eigen::Matrix2d P = P0;
  for (std::size_t n = 0; n < N; ++n) {
    if (n > 0) {
      x = F * x;
      P = F * P * F.transpose() + Q;
    }
    const double S = (H * P * H.transpose())(0) + R;
    const Eigen::Vector2d K = P * H.transpose() / S;
    const double z = y[n] - (H * x)(0);
    x += K * z;
    P = (Eigen::Matrix2d::Identity() - K * H) * P;
    kept[n] = {z, S, K};
  }
  Eigen::Vector2d u = Eigen::Vector2d::Zero();
  for (std::size_t n = N; n-- > 0;) {
    const Step& s = kept[n];
    out[n] = s.K.dot(u) + 2.0 * s.z / s.S;
    u = F.transpose() *
        ((Eigen::Matrix2d::Identity() - s.K * H).transpose() * u - 2.0 * H.transpose() * s.z / s.S);
  }
}

}  // namespace

/// `calls` times the same, so that the caller's overhead is not measured.
extern "C" void w4_eigen(const double* y, std::size_t N, const double* F, const double* Q, double R,
                         const double* x0, const double* P0, double* out, std::size_t calls) {
  using Row = Eigen::Matrix<double, 2, 2, Eigen::RowMajor>;
  std::vector<Step> kept(N);
  for (std::size_t c = 0; c < calls; ++c)
    gradient(y, N, Eigen::Map<const Row>(F), Eigen::Map<const Row>(Q), R,
             Eigen::Map<const Eigen::Vector2d>(x0), Eigen::Map<const Row>(P0), kept, out);
}
