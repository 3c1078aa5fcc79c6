// What a fuzzer's bytes become: numbers of any kind, the awkward ones more often than by chance.
#pragma once

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <limits>

namespace surefix::fuzz {

class Bytes {
 public:
  Bytes(const std::uint8_t* data, std::size_t size) : data_(data), end_(data + size) {}

  [[nodiscard]] bool more() const { return data_ < end_; }
  [[nodiscard]] std::uint8_t byte() { return more() ? *data_++ : std::uint8_t{0}; }
  template <class T>
  [[nodiscard]] T raw() {
    T out{};
    for (std::size_t i = 0; i < sizeof out; ++i) {
      const std::uint8_t value = byte();
      std::memcpy(reinterpret_cast<char*>(&out) + i, &value, 1);
    }
    return out;
  }
  /// Any double, or one near `usual`.
  [[nodiscard]] double number(double usual, double spread) {
    constexpr double infinity = std::numeric_limits<double>::infinity();
    switch (byte() % 16) {
      case 0:
        return raw<double>();
      case 1:
        return std::numeric_limits<double>::quiet_NaN();
      case 2:
        return infinity;
      case 3:
        return -infinity;
      case 4:
        return 0.0;
      case 5:
        return -1e300;
      case 6:
        return 1e-300;
      default:
        return usual + spread * (raw<std::int16_t>() / 4096.0);
    }
  }
  /// A step in time [ns], mostly of milliseconds.
  [[nodiscard]] std::int64_t time() {
    switch (byte() % 16) {
      case 0:
        return raw<std::int64_t>();
      case 1:
        return 0;
      case 2:
        return -std::int64_t{raw<std::int32_t>()};
      case 3:
        return 31'557'600'000'000'000;  // a year
      case 4:
        return 1;
      default:
        return std::int64_t{raw<std::int16_t>()} * 10'000;
    }
  }

 private:
  const std::uint8_t* data_;
  const std::uint8_t* end_;
};

inline void require(bool good, const char* what) {
  if (good) return;
  std::fprintf(stderr, "not so: %s\n", what);
  std::abort();
}

}  // namespace surefix::fuzz
