// Modes whose models have different states: what a state becomes when the mode changes.
#pragma once

#include <vector>

#include "surefix/core/lane.hpp"
#include "surefix/switching/sizes.hpp"

namespace surefix::switching {

/// The states of all modes together, numbered; which of them each mode has.
///
/// A state that the mode before did not have begins as N(mean, variance), independent of all else;
/// one that the mode after does not have is left out.
struct StateMap {
  std::vector<std::vector<int>> states;  // of every mode: the numbers of its states
  std::vector<int> all;                  // every number
  std::vector<double> mean, variance;    // of each number, where it begins

  [[nodiscard]] int size() const noexcept { return static_cast<int>(mean.size()); }
  /// Where mode `i` holds state `number`, −1 if it does not.
  [[nodiscard]] int find(int i, int number) const noexcept {
    const std::vector<int>& own = states[at(i)];
    for (int k = 0; k < static_cast<int>(own.size()); ++k)
      if (own[at(k)] == number) return k;
    return -1;
  }
};

/// The bank's Gaussians as beliefs about the states `wanted`, as `mix` reads them.
template <class Bank, class Lane>
struct MappedStates {
  const Bank& bank;
  const StateMap& map;
  const std::vector<int>& wanted;

  // By value: `mix` makes the terms of its sums numbers where there may be such sources.
  [[nodiscard]] Lane x(int i, int a) const noexcept {
    const int number = wanted[at(a)], own = map.find(i, number);
    return own >= 0 ? Lane(bank[at(i)].x(own)) : Lanes<Lane>::all(map.mean[at(number)]);
  }
  [[nodiscard]] Lane P(int i, int a, int b) const noexcept {
    const int number = wanted[at(a)];
    const int own = map.find(i, number), other = map.find(i, wanted[at(b)]);
    if (own >= 0 && other >= 0) return bank[at(i)].P(own, other);
    return Lanes<Lane>::all(own < 0 && a == b ? map.variance[at(number)] : 0.0);
  }
};

}  // namespace surefix::switching
