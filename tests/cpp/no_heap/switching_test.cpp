#include "switching/switching.hpp"

#include "no_heap/allocations.hpp"
#include "surefix/switching/any_filter.hpp"

namespace surefix::no_heap {
namespace {

using namespace switching;
using namespace switching::testing;

TEST_F(NoHeap, InStepsOfTheSwitchingFilters) {
  const Prepared prepared;
  switching::Filter<Method::imm, Two> imm;
  switching::Filter<Method::one_step, Two> one_step;
  const auto& initial = prepared.system.initial();
  ASSERT_EQ(imm.make(four_modes(), initial), ConfigStatus::ok);
  ASSERT_EQ(one_step.make(four_modes(), initial), ConfigStatus::ok);
  bool ok = true;
  EXPECT_EQ(allocations([&] {
              for (int k = 0; k < 300; ++k) {  // with gaps and gross outliers
                Measured<Two> z;
                z(0) = measurement(2, k);
                ok &= imm.step(prepared.transition(), prepared.observation(), z) == Status::ok;
                ok &= one_step.step(prepared.transition(), prepared.observation(), z) == Status::ok;
              }
            }),
            0);
  EXPECT_TRUE(ok);
}

/// Allocations of a run of `runs` series of T steps each.
long allocations_of(const switching::AnyFilter& filter, int runs, int T) {
  std::vector<double> z;
  for (int run = 0; run < runs; ++run)
    for (int k = 0; k < T; ++k) z.push_back(measurement(run, k));
  std::vector<double> x(z.size() * 2), P(2 * x.size()), likelihood(z.size());
  Status status{};
  const long count = allocations([&] {
    status =
        filter
            .run({z.data(), nullptr, 0, runs, T}, {x.data(), P.data(), nullptr, likelihood.data()})
            .status;
  });
  EXPECT_EQ(status, Status::ok);
  return count;
}

TEST_F(NoHeap, InStepsOfSwitchingFiltersOfAnySizeButBeforeTheFirst) {
  FilterPlan plan;
  plan.systems = {two_states()};
  plan.chain = four_modes();
  plan.p = {plan.chain.transition};
  std::unique_ptr<switching::AnyFilter> filters[3];
  ASSERT_EQ(switching::AnyFilter::make(Method::imm, plan, filters[0]), ConfigStatus::ok);
  ASSERT_EQ(switching::AnyFilter::make(Method::one_step, plan, filters[1]), ConfigStatus::ok);
  ASSERT_EQ(switching::AnyFilter::make_genie(two_states(), {{1.0, 1.0}}, filters[2]),
            ConfigStatus::ok);
  for (const auto& filter : filters)
    for (const int runs : {1, 8}) {
      const long few = allocations_of(*filter, runs, 20);
      EXPECT_EQ(allocations_of(*filter, runs, 2000), few);
    }
}

}  // namespace
}  // namespace surefix::no_heap
