// Which form of the scalar covariance update?  See README.md.
//   covariance_forms time | accuracy [steps2 steps10] | long [steps2 steps10] | restart [steps]
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <tuple>
#include <utility>
#include <vector>

#include "bierman_thornton.hpp"
#include "health.hpp"
#include "joseph_component.hpp"
#include "joseph_symmetric.hpp"
#include "joseph_textbook.hpp"
#include "joseph_two_pass.hpp"
#include "plain.hpp"
#include "sequences.hpp"
#include "two_state.hpp"

namespace {

template <int n>
using Forms =
    std::tuple<Plain<double, n>, JosephTwoPass<double, n, Keep::upper>,
               JosephTwoPass<double, n, Keep::lower>, JosephTwoPass<double, n, Keep::average>,
               JosephSymmetric<double, n>, JosephSymmetric<double, n, 4>, JosephTextbook<double, n>,
               BiermanThornton<double, n>, JosephComponent<double, n>>;
using Written2 = std::tuple<TwoState<Written::plain>, TwoState<Written::lower>,
                            TwoState<Written::symmetric>, TwoState<Written::inflated>>;
constexpr int form_count = 9;
const char* const form_name[form_count] = {
    "a   plain",     "b1u two-pass upper", "b1l two-pass lower", "b2  two-pass average",
    "b3  symmetric", "b4  b3 + inflation", "c   textbook",       "d   Bierman-Thornton",
    "b5  component"};

// Calls body(form, index) for every form.
template <class Tuple, class Body, std::size_t... i>
void for_each(Tuple& forms, Body body, std::index_sequence<i...>) {
  (body(std::get<i>(forms), i), ...);
}
template <class Tuple, class Body>
void for_each(Tuple& forms, Body body) {
  for_each(forms, body, std::make_index_sequence<std::tuple_size_v<Tuple>>());
}

// ---- time ------------------------------------------------------------------

template <int n>
struct Reading {
  Step<n> step;
  double z;
};

double sink = 0;

// Nanoseconds per predict + update + reading the estimate and its variance.
template <int n, class Form>
__attribute__((noinline)) double pass(Form form, const std::vector<Reading<n>>& readings) {
  const auto begin = std::chrono::steady_clock::now();
  double sum = 0;
  for (const auto& reading : readings) {
    form.predict(reading.step.t);
    form.update(reading.step.h, reading.step.r, reading.z);
    sum += form.x[0] + form.variance(0);
  }
  const std::chrono::duration<double, std::nano> time = std::chrono::steady_clock::now() - begin;
  sink += sum;
  return time.count() / readings.size();
}

double median(std::vector<double> v) {
  std::nth_element(v.begin(), v.begin() + v.size() / 2, v.end());
  return v[v.size() / 2];
}

template <int n, class Tuple>
void time_forms(Tuple forms, const std::vector<const char*>& names, int repetitions) {
  Random random{std::mt19937_64(7)};
  std::vector<Reading<n>> readings(100000);
  for (auto& [step, z] : readings) {
    step.t = transition<n>(random.log(-3, 1), 1e-2);
    step.h = sensor<n>(random.below(4), random.uniform(-50, 50));
    step.r = random.log(-4, 0);
    z = random.uniform(-1, 1);
  }
  const Sequence<n> start(sweep, 1, false, 1, 1);
  for_each(forms, [&](auto& form, int) { form.start(start.U0, start.D0); });

  std::vector<std::vector<double>> ns(names.size()), ratio(names.size());
  for (int rep = 0; rep < repetitions; ++rep)
    for_each(forms, [&](auto& form, int i) {
      ns[i].push_back(pass<n>(form, readings));
      ratio[i].push_back(ns[i].back() / ns[0].back());
    });
  std::printf(
      "\nn = %d, %d interleaved repetitions\n"
      "| form | median ns | fastest ns | median ratio to a |\n|---|---|---|---|\n",
      n, repetitions);
  for (std::size_t i = 0; i < names.size(); ++i)
    std::printf("| %s | %.1f | %.1f | %.2f |\n", names[i], median(ns[i]),
                *std::min_element(ns[i].begin(), ns[i].end()), median(ratio[i]));
}

// ---- accuracy and definiteness ---------------------------------------------

constexpr double edges[] = {2e6, 2e12, 2e16, INFINITY};
constexpr int bins = 4;
const char* const bin_name[bins] = {"<= 1e6", "<= 1e12", "<= 1e16", "> 1e16"};

using Results = std::vector<Health>;  // [bin][form]

void print(const char* title, const Health* row, bool errors) {
  if (!row->steps) return;
  std::printf("\n%s: %ld checks per form\n", title, row->steps);
  std::printf("| form | indefinite | diagonal <= 0 | min eigenvalue |%s",
              errors ? " diagonal error | pair error |\n|---|---|---|---|---|---|\n"
                     : "\n|---|---|---|---|\n");
  for (int i = 0; i < form_count; ++i) {
    std::printf("| %s | %ld | %ld | %.1e |", form_name[i], row[i].indefinite, row[i].bad_diagonal,
                row[i].smallest);
    if (errors) std::printf(" %.1e | %.1e |", row[i].diagonal_error, row[i].pair_error);
    std::printf("\n");
  }
}

// The step's r, never below 1e-18 of the predicted h P h'.
template <int n, class Driver>
double variance(const Step<n>& s, const Driver& driver) {
  const auto P = driver.covariance();
  double prior = 0;
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) prior += s.h[i] * double(P[i][j]) * s.h[j];
  prior = std::max(prior, 1e-60);
  return s.relative ? s.r * prior : std::max(s.r, 1e-18 * prior);
}

// Runs all forms beside `driver`, which fixes relative variances and says how
// collinear P has been so far; all are compared with it when asked.  `restart`
// returns every form to P0 after that many steps, and forgets the worst so far.
template <int n, class Driver>
void run(Sequence<n> sequence, long steps, Driver driver, bool compare, Results& results,
         long restart = 0) {
  Forms<n> forms;
  double worst = 1;
  const auto start = [&] {
    for_each(forms, [&](auto& form, int) { form.start(sequence.U0, sequence.D0); });
    driver.start(sequence.U0, sequence.D0);
    worst = 1;
  };
  start();

  const auto check = [&] {
    worst = std::max(worst, collinearity<Driver, n>(driver));
    int bin = 0;
    while (worst > edges[bin]) ++bin;
    const auto exact = driver.covariance();
    for_each(forms, [&](auto& form, int i) {
      Health& health = results[bin * form_count + i];
      const Matrix<double, n> P = form.covariance();
      health.template check<n>(P);
      if (compare) health.template compare<n>(P, exact);
    });
  };

  for (long k = 0; k < steps; ++k) {
    if (restart && k % restart == 0) start();
    Step<n> s = sequence.next();
    driver.predict(s.t);
    for_each(forms, [&](auto& form, int) { form.predict(s.t); });
    if (compare) check();
    s.r = variance(s, driver);
    driver.update(s.h, s.r, 0);
    for_each(forms, [&](auto& form, int) { form.update(s.h, s.r, 0); });
    check();
  }
}

// The reference itself: UD against textbook Joseph, both in 113-bit arithmetic.
template <int n>
double reference_disagreement(Sequence<n> sequence, long steps) {
  BiermanThornton<__float128, n> ud;
  JosephTextbook<__float128, n> joseph;
  ud.start(sequence.U0, sequence.D0);
  joseph.start(sequence.U0, sequence.D0);
  double worst = 0;
  for (long k = 0; k < steps; ++k) {
    Step<n> s = sequence.next();
    ud.predict(s.t), joseph.predict(s.t);
    s.r = variance(s, ud);
    ud.update(s.h, s.r, 0), joseph.update(s.h, s.r, 0);
    for (int i = 0; i < n; ++i)
      worst = std::max(worst, std::abs(double(joseph.variance(i) / ud.variance(i) - 1)));
  }
  return worst;
}

template <int n>
void accuracy(long steps) {
  Results by_kind[kinds], all(bins * form_count);
  double reference = 0;
  for (int kind = 0; kind < kinds; ++kind) {
    by_kind[kind].resize(bins * form_count);
    for (double condition : {1e0, 1e4, 1e8, 1e12, 1e16})
      for (bool correlated : {false, true})
        for (double q2 : {1., 1e-12})
          for (int seed : {1, 2}) {
            const Sequence<n> sequence(Kind(kind), condition, correlated, q2, seed);
            run<n>(sequence, steps, BiermanThornton<__float128, n>(), true, by_kind[kind]);
            reference = std::max(reference, reference_disagreement<n>(sequence, steps / 10));
          }
    for (std::size_t i = 0; i < all.size(); ++i) all[i].merge(by_kind[kind][i]);
  }
  std::printf("\n## n = %d, %ld steps per sequence; reference agrees with itself to %.0e\n", n,
              steps, reference);
  char title[100];
  for (int bin = 0; bin < bins; ++bin) {
    std::snprintf(title, sizeof title, "n = %d, collinearity %s, all sequences", n, bin_name[bin]);
    print(title, &all[bin * form_count], true);
  }
  for (int kind = 0; kind < kinds; ++kind) {
    Results sum(form_count);  // collinearity up to 1e12
    for (int bin = 0; bin < 2; ++bin)
      for (int i = 0; i < form_count; ++i) sum[i].merge(by_kind[kind][bin * form_count + i]);
    std::snprintf(title, sizeof title, "n = %d, up to 1e12, %s", n, kind_name[kind]);
    print(title, sum.data(), true);
  }
}

// Definiteness alone; Bierman-Thornton in double drives.  restart = 0: one
// unbroken run.
template <int n>
void long_run(long steps, long restart, double condition) {
  for (Kind kind : {sweep, year, components, mixed})
    for (double q2 : {1., 1e-12}) {
      Results results(bins * form_count);
      run<n>(Sequence<n>(kind, condition, true, q2, 3), steps, BiermanThornton<double, n>(), false,
             results, restart);
      for (int bin = 0; bin < bins; ++bin) {
        char title[160];
        std::snprintf(title, sizeof title,
                      "n = %d, %s, q2 = %.0e, P0 at %.0e, restart %ld, collinearity so far %s", n,
                      kind_name[kind], q2, condition, restart, bin_name[bin]);
        print(title, &results[bin * form_count], false);
      }
    }
}

}  // namespace

int main(int argc, char** argv) {
  const char* what = argc > 1 ? argv[1] : "";
  const auto number = [&](int i, long otherwise) {
    return argc > i ? std::atol(argv[i]) : otherwise;
  };
  if (!std::strcmp(what, "time")) {
    const std::vector<const char*> names(form_name, form_name + form_count);
    time_forms<2>(Written2(),
                  {"a   written out", "b1l written out", "b3  written out", "b4  written out"},
                  401);
    time_forms<2>(Forms<2>(), names, 201);
    time_forms<10>(Forms<10>(), names, 41);
    return sink == 0.123;  // keeps the timed work alive
  }
  if (!std::strcmp(what, "accuracy")) {
    accuracy<2>(number(2, 5000));
    accuracy<10>(number(3, 500));
    return 0;
  }
  if (!std::strcmp(what, "long")) {
    long_run<2>(number(2, 10000000), 0, 1e12);
    long_run<10>(number(3, 1000000), 0, 1e12);
    return 0;
  }
  if (!std::strcmp(what, "restart")) {  // back to a collinear P0 every 20 steps
    for (double condition : {1e12, 1e14, 1e15, 1e16})
      long_run<2>(number(2, 10000000), 20, condition);
    return 0;
  }
  std::fprintf(
      stderr,
      "usage: %s time | accuracy [steps2 steps10] | long [steps2 steps10] | restart [steps2]\n",
      argv[0]);
  return 2;
}
