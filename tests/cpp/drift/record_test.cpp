// What the sweeps find against Γ of all measurements, formed and inverted.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>

#include "dense.hpp"
#include "surefix/drift/any_gradient.hpp"
#include "surefix/drift/any_record.hpp"
#include "surefix/drift/likelihood_ratio.hpp"
#include "surefix/drift/sliding_record.hpp"

namespace surefix::drift {
namespace {

/// A system of n states and m correlated outputs, and one run of it with inputs and irregular
/// times.
struct Case {
  LinearSystem system;
  Eigen::VectorXd z, inputs;
  std::vector<double> times;
  int T, n, m;

  Case(int states, int outputs, int steps, std::uint64_t seed, bool missing)
      : T(steps), n(states), m(outputs) {
    test::Random random(seed);
    for (int k = 0; k + 1 < T; ++k) {
      system.A.push_back(0.4 * test::random_matrix(random, n, n));
      system.Q.push_back(test::random_covariance(random, n));
    }
    system.H = {test::random_matrix(random, m, n)};
    system.R = {test::random_covariance(random, m)};
    system.x0 = test::random_matrix(random, n, 1);
    system.P0 = test::random_covariance(random, n);
    z = test::random_matrix(random, T * m, 1);
    inputs = test::random_matrix(random, (T - 1) * n, 1);
    for (int k = 0; k < T; ++k) times.push_back(k + 0.3 * random.uniform());
    if (missing)
      for (const int i : {1, 4, 5}) z(i) = std::numeric_limits<double>::quiet_NaN();
  }
  SystemData data() const { return {z.data(), inputs.data(), times.data(), 1, T}; }

  /// Γ and γ of those that are there.
  void dense(std::vector<int>& kept, Eigen::MatrixXd& Gamma, Eigen::VectorXd& gamma) const {
    Eigen::MatrixXd Z = Eigen::MatrixXd::Zero(T * m, T * m);
    std::vector<Eigen::MatrixXd> P{system.P0};
    std::vector<Eigen::VectorXd> x{system.x0};
    for (std::size_t k = 0; k + 1 < static_cast<std::size_t>(T); ++k) {
      P.push_back(system.A[k] * P[k] * system.A[k].transpose() + system.Q[k]);
      x.push_back(system.A[k] * x[k] + inputs.segment(static_cast<int>(k) * n, n));
    }
    Eigen::VectorXd own(T * m);
    const Eigen::MatrixXd& H = system.H.front();
    for (int k = 0; k < T; ++k) {
      own.segment(k * m, m) = z.segment(k * m, m) - H * x[static_cast<std::size_t>(k)];
      Eigen::MatrixXd C = P[static_cast<std::size_t>(k)];  // cov(x_j, x_k)
      for (int j = k; j < T; ++j) {
        const Eigen::MatrixXd block = H * C * H.transpose();
        Z.block(j * m, k * m, m, m) = block;
        Z.block(k * m, j * m, m, m) = block.transpose();
        if (j + 1 < T) C = system.A[static_cast<std::size_t>(j)] * C;
      }
      Z.block(k * m, k * m, m, m) += system.R.front();
    }
    kept.clear();
    for (int i = 0; i < T * m; ++i)
      if (!std::isnan(z(i))) kept.push_back(i);
    const auto count = static_cast<Eigen::Index>(kept.size());
    Gamma.resize(count, count);
    gamma.resize(count);
    for (Eigen::Index i = 0; i < count; ++i) {
      gamma(i) = own(kept[static_cast<std::size_t>(i)]);
      for (Eigen::Index j = 0; j < count; ++j)
        Gamma(i, j) = Z(kept[static_cast<std::size_t>(i)], kept[static_cast<std::size_t>(j)]);
    }
  }
};

Profile ramp() {
  Profile out;
  Profile::Matrix A(2, 2), onset(2, 1);
  A << 0, 1, 0, 0;
  onset << 0, 1;
  EXPECT_EQ(Profile::make(A, Eigen::Vector2d(1, 0), onset, out), ConfigStatus::ok);
  return out;
}

void expect_dense(const Case& c) {
  Status status = Status::ok;
  const auto record = AnyRecord::of(c.system, c.data(), status);
  ASSERT_EQ(status, Status::ok);
  std::vector<int> kept;
  Eigen::MatrixXd Gamma;
  Eigen::VectorXd gamma;
  c.dense(kept, Gamma, gamma);
  const Eigen::LLT<Eigen::MatrixXd> factor(Gamma);
  const Eigen::VectorXd w = factor.solve(gamma);

  // A pulse in every channel: gradient and diagonal of Γ⁻¹. A ramp: every onset.
  for (const bool pulse : {true, false}) {
    for (int channel = 0; channel < c.m; ++channel) {
      Search search{pulse ? Profile::pulse() : ramp(),
                    std::vector<double>(static_cast<std::size_t>(c.m), 0.0)};
      search.direction[static_cast<std::size_t>(channel)] = 1.0;
      Onsets onsets;
      ASSERT_TRUE(record->onsets(search, onsets));
      const std::size_t K = onsets.count, skipped = onsets.share.size() - K;
      std::vector<double> num(K);
      ASSERT_TRUE(record->scan(search, {record->innovations.data(), 0, 1}, K, num.data()));
      std::vector<int> begun;
      for (int k = 0; k < c.T; ++k)
        if (!std::isnan(c.z(k * c.m + channel))) begun.push_back(k);
      ASSERT_EQ(K, begun.size());
      for (std::size_t o = 0; o < K; ++o) {
        const int from = begun[o];
        Eigen::VectorXd d = Eigen::VectorXd::Zero(gamma.size());
        for (std::size_t i = 0; i < kept.size(); ++i) {
          const int k = kept[i] / c.m;
          if (kept[i] % c.m != channel || k < from) continue;
          const double since =
              c.times[static_cast<std::size_t>(k)] - c.times[static_cast<std::size_t>(from)];
          d(static_cast<int>(i)) = pulse ? (k == from ? 1.0 : 0.0) : since;
        }
        const double G = d.dot(factor.solve(d));
        EXPECT_NEAR(num[o], d.dot(w), 1e-10 * (1.0 + std::abs(d.dot(w))));
        if (onsets.share[skipped + o] > detectable) {
          EXPECT_NEAR(onsets.inverse[skipped + o] * G, 1.0, 1e-9) << o;
        } else {
          EXPECT_LT(G, 1e-9) << o;  // a ramp that begins with the last measurement
        }
      }
    }
  }
  const double log_likelihood =
      -0.5 *
      (gamma.dot(w) + 2.0 * Eigen::MatrixXd(factor.matrixL()).diagonal().array().log().sum() +
       static_cast<double>(gamma.size()) * std::log(2.0 * M_PI));
  EXPECT_NEAR(record->log_likelihood.front(), log_likelihood, 1e-9 * std::abs(log_likelihood));
}

TEST(Record, FindsWhatTheDenseCovarianceFinds) {
  expect_dense(Case(2, 1, 12, 1, false));
  expect_dense(Case(2, 1, 12, 2, true));
  expect_dense(Case(4, 3, 9, 3, false));
  expect_dense(Case(4, 3, 9, 4, true));
}

TEST(Record, TheGradientIsTwiceTheWhitenedInnovation) {
  for (const int m : {1, 3}) {
    const Case c(2, m, 20, 7, false);
    std::unique_ptr<AnyGradient> engine;
    ASSERT_EQ(AnyGradient::make(c.system, engine), ConfigStatus::ok);
    std::vector<double> g(static_cast<std::size_t>(c.z.size()));
    ASSERT_EQ(engine->run(c.z.data(), c.T, c.inputs.data(), g.data()), Status::ok);
    std::vector<int> kept;
    Eigen::MatrixXd Gamma;
    Eigen::VectorXd gamma;
    c.dense(kept, Gamma, gamma);
    const Eigen::VectorXd truth = 2.0 * Gamma.llt().solve(gamma);
    for (Eigen::Index i = 0; i < truth.size(); ++i)
      EXPECT_NEAR(g[static_cast<std::size_t>(i)], truth(i), 1e-11 * truth.cwiseAbs().maxCoeff());
  }
}

TEST(Record, RunsSideBySideAreTheSameBitsAsOneByOne) {
  const Case c(2, 1, 30, 9, false);
  std::vector<double> all;
  constexpr int runs = 11;
  for (int run = 0; run < runs; ++run)
    for (Eigen::Index i = 0; i < c.z.size(); ++i) all.push_back(c.z(i) * (1 + run));
  Status status = Status::ok;
  const auto together =
      AnyRecord::of(c.system, {all.data(), c.inputs.data(), c.times.data(), runs, c.T}, status);
  const Search search{ramp(), {1.0}};
  Onsets onsets;
  ASSERT_TRUE(together->onsets(search, onsets));
  const std::size_t K = onsets.count;
  std::vector<double> num(runs * K), one(runs * K);
  ASSERT_TRUE(together->scan(search, {together->innovations.data(), 0, runs}, K, num.data()));
  for (std::int64_t run = 0; run < runs; ++run)
    ASSERT_TRUE(
        together->scan(search, {together->innovations.data(), run, run + 1}, K, one.data()));
  EXPECT_EQ(num, one);
}

TEST(Record, SeveralAmplitudesAreThoseOfTheDenseCovariance) {
  const Case c(2, 1, 14, 12, false);
  Status status = Status::ok;
  const auto record = AnyRecord::of(c.system, c.data(), status);
  ASSERT_EQ(status, Status::ok);
  std::vector<int> kept;
  Eigen::MatrixXd Gamma;
  Eigen::VectorXd gamma;
  c.dense(kept, Gamma, gamma);
  const Eigen::LLT<Eigen::MatrixXd> factor(Gamma);
  for (const int q : {2, 3, 4}) {  // 1, t, t²/2, t³/6, of unknown amplitudes
    Profile::Matrix A = Profile::Matrix::Zero(q, q);
    for (int j = 1; j < q; ++j) A(j - 1, j) = 1.0;
    Profile::Vector output = Profile::Vector::Zero(q);
    output(0) = 1.0;
    Search search{{}, {1.0}};
    ASSERT_EQ(Profile::make(A, output, Profile::Matrix::Identity(q, q), search.profile),
              ConfigStatus::ok);
    Onsets onsets;
    ASSERT_TRUE(record->onsets(search, onsets));
    ASSERT_EQ(onsets.count, 14u);
    for (std::size_t o = 0; o < 14; ++o) {
      Eigen::MatrixXd D = Eigen::MatrixXd::Zero(14, q);
      for (std::size_t k = o; k < 14; ++k) {
        double term = 1.0;
        for (int a = 0; a < q; ++a) {
          D(static_cast<int>(k), a) = term;
          term *= (c.times[k] - c.times[o]) / (a + 1);
        }
      }
      const auto left = 14 - static_cast<int>(o);
      if (left < q) {  // fewer measurements than amplitudes
        EXPECT_FALSE(onsets.share[o] > detectable) << o;
        EXPECT_TRUE(std::isnan(onsets.inverse[o * static_cast<std::size_t>(q * q)])) << o;
      } else if (left > q) {
        const Eigen::MatrixXd G = D.transpose() * factor.solve(D);
        const Eigen::Map<const Eigen::MatrixXd> inverse(
            &onsets.inverse[o * static_cast<std::size_t>(q * q)], q, q);
        ASSERT_GT(onsets.share[o], detectable) << q << " " << o;
        EXPECT_LT((G * inverse - Eigen::MatrixXd::Identity(q, q)).norm(), 1e-6) << q << " " << o;
      }
    }
  }
}

/// Two amplitudes whose information is G where the state is unknown, K where it is known.
Detectability two(const Profile::Matrix& G, const Profile::Matrix& K) {
  return detectability({G, K}, Profile::Matrix::Identity(2, 2));
}
Profile::Matrix symmetric(double a, double b, double d) {
  return (Profile::Matrix(2, 2) << a, b, b, d).finished();
}

TEST(Detectability, AmplitudesThatAreOneAreNotTwo) {
  const Profile::Matrix good = symmetric(1.0, 0.5, 1.0);
  const Detectability found = two(0.5 * good, good);
  EXPECT_NEAR(found.share, 0.5, 1e-14);
  EXPECT_LT((found.inverse * found.gram - Profile::Matrix::Identity(2, 2)).norm(), 1e-14);
  // Even of a known state the same to the last digit, nearly so, or one of them not seen.
  for (const auto& K : {symmetric(1.0, 1.0, 1.0), symmetric(1.0, 1.0 - 1e-10, 1.0),
                        symmetric(1.0, 0.0, 1e-30), symmetric(1.0, 0.0, NAN)}) {
    const Detectability none = two(0.5 * good, K);
    EXPECT_TRUE(none.undetectable());
    EXPECT_TRUE(none.inverse.array().isNaN().all());
  }
}

TEST(Detectability, WhatHasAShareHasAnInverse) {
  // G is singular to the last digits, and K so near to it that rounding can make of its share a
  // number that is not small.
  const double apart = 6e-10, reach = std::sqrt(2.0 * apart);
  const Profile::Matrix K = symmetric(1.0, 1.0 - apart, 1.0);
  test::Random random(5);
  int seen = 0;
  for (int i = 0; i < 1000; ++i) {
    const double level = random.uniform(0.1, 0.9), g = 1.0 - reach * random.uniform();
    const Detectability found = two(symmetric(level, level * g, level * g * g), K);
    if (found.undetectable()) continue;
    ++seen;
    EXPECT_TRUE(found.inverse.allFinite()) << i;
    EXPECT_GT(found.inverse.diagonal().minCoeff(), 1e12) << i;  // 1/rounding
  }
  EXPECT_GT(seen, 0);
}

TEST(OnsetSweep, AFaultBeginsWhereItIsSeen) {
  SlidingRecord<2, 2, 4> record(2);
  const Eigen::Vector2d k(0.5, 0.25), h(1.0, 0.0);
  const Innovation<Gaussian<2>> innovation{1.0, 2.0, 0.5, k};
  for (const int i : {0, 1, 2})
    record.add(innovation, DenseRow<Eigen::Vector2d>{h}, 1.0, Eigen::Matrix2d::Identity(),
               i == 2 ? 0.0 : 0.1, i, 0);
  const double first[] = {1.0, 0.0, 0.0}, last[] = {0.0, 0.0, 1.0}, both[] = {0.0, 1.0, 1.0};
  EXPECT_TRUE(can_begin(record, first, 0));
  EXPECT_FALSE(can_begin(record, first, 1));
  EXPECT_FALSE(can_begin(record, last, 1));
  EXPECT_TRUE(can_begin(record, last, 2));
  EXPECT_TRUE(can_begin(record, both, 1));
  EXPECT_FALSE(can_begin(record, both, 2));  // at the same time as the one before
}

TEST(Record, RefusesASystemThatIsNone) {
  for (const int m : {1, 2}) {
    Case c(2, m, 6, 3, false);
    c.system.A[2](1, 0) = std::numeric_limits<double>::quiet_NaN();
    std::unique_ptr<AnyGradient> engine;
    EXPECT_EQ(AnyGradient::make(c.system, engine), ConfigStatus::not_finite);
    EXPECT_EQ(engine, nullptr);
    Status status = Status::ok;
    EXPECT_EQ(AnyRecord::of(c.system, c.data(), status), nullptr);
    EXPECT_EQ(status, Status::numerical);
  }
}

TEST(Record, SaysWhereTheFilterFails) {
  for (const int m : {1, 2}) {
    Case c(2, m, 6, 3, false);
    c.system.H.front()(m - 1, 0) = 1e200;  // h P hᵀ overflows
    std::unique_ptr<AnyGradient> engine;
    ASSERT_EQ(AnyGradient::make(c.system, engine), ConfigStatus::ok);
    std::vector<double> g(static_cast<std::size_t>(c.z.size()));
    EXPECT_EQ(engine->run(c.z.data(), c.T, c.inputs.data(), g.data()), Status::numerical);
    Status status = Status::ok;
    EXPECT_EQ(AnyRecord::of(c.system, c.data(), status), nullptr);
    EXPECT_EQ(status, Status::numerical);
    if (m == 1) continue;
    c.z(0) = std::numeric_limits<double>::quiet_NaN();  // and where only the other is there
    status = Status::ok;
    EXPECT_EQ(AnyRecord::of(c.system, c.data(), status), nullptr);
    EXPECT_EQ(status, Status::numerical);
  }
  Case far(2, 1, 6, 3, false);
  far.z(4) = 1e200;  // the gains are good, the likelihood is not
  Status status = Status::ok;
  EXPECT_EQ(AnyRecord::of(far.system, far.data(), status), nullptr);
  EXPECT_EQ(status, Status::numerical);
}

TEST(Record, AMissingComponentCanLeaveNoiseThatIsNotDefinite) {
  // Two components so nearly one that the rounding of a third, correlated with both, decides.
  Case c(2, 3, 6, 3, false);
  c.z(0) = std::numeric_limits<double>::quiet_NaN();
  bool found = false;
  for (int i = 1; i < 1000 && !found; ++i) {
    const double common = 0.001 * i, near = 1.0 - std::ldexp(45.0, -53);
    c.system.R.front() << 1.0, common, common, common, 1.0, near, common, near, 1.0;
    std::unique_ptr<AnyGradient> whole;
    found = AnyGradient::make(c.system, whole) == ConfigStatus::ok;
  }
  ASSERT_TRUE(found);
  Status status = Status::ok;
  EXPECT_EQ(AnyRecord::of(c.system, c.data(), status), nullptr);
  EXPECT_EQ(status, Status::numerical);
  c.z(0) = 0.0;  // all of them are good
  EXPECT_NE(AnyRecord::of(c.system, c.data(), status), nullptr);
  EXPECT_EQ(status, Status::ok);
}

TEST(Record, AProfileThatOverflowsIsRefused) {
  const Case c(2, 1, 6, 3, false);
  Status status = Status::ok;
  const auto record = AnyRecord::of(c.system, c.data(), status);
  ASSERT_EQ(status, Status::ok);
  Search search{{}, {1.0}};
  const Profile::Matrix one = Profile::Matrix::Ones(1, 1);
  ASSERT_EQ(Profile::make(2000.0 * one, Profile::Vector::Ones(1), one, search.profile),
            ConfigStatus::ok);
  std::vector<double> rho(record->size());
  EXPECT_FALSE(record->response(search, 0, rho.data()));
  EXPECT_TRUE(record->response(search, record->size() - 1, rho.data()));  // it has no time to
  EXPECT_EQ(rho.back(), 1.0);
  Onsets onsets;
  EXPECT_FALSE(record->onsets(search, onsets));
}

}  // namespace
}  // namespace surefix::drift
