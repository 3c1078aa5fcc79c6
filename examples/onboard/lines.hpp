// Lines of comma-separated numbers from standard input, and no heap: what stands for the bus of a
// vehicle in these examples.
#pragma once

#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <limits>

/// One line: a letter that says what it is, then numbers. "M,1200000000,0,19.5".
class Lines {
 public:
  static constexpr int most = 8;

  Lines() {
    std::setvbuf(stdin, in_, _IOFBF, sizeof in_);
    std::setvbuf(stdout, out_, _IOFBF, sizeof out_);
  }

  /// False at the end of the input; what was written goes out before the wait. What is no line of
  /// ours, or too long to be one, has the kind '?'.
  [[nodiscard]] bool next() {
    std::fflush(stdout);
    if (std::fgets(text_, sizeof text_, stdin) == nullptr) return false;
    char* const end = std::strpbrk(text_, "\r\n");
    if (end != nullptr) *end = '\0';
    if (end == nullptr && !skip_line()) text_[0] = '\0';
    kind_ = text_[0] != '\0' && (text_[1] == ',' || text_[1] == '\0') ? text_[0] : '?';
    bad_ = kind_ == '?';
    char* at = text_;
    for (const char*& start : start_) {
      at = at != nullptr ? std::strchr(at, ',') : nullptr;
      if (at != nullptr) *at++ = '\0';
      start = at != nullptr ? at : "";
    }
    return true;
  }
  [[nodiscard]] char kind() const { return kind_; }

  /// Field i; NaN, and the line is bad, if that is not one number.
  [[nodiscard]] double number(int i) {
    char* end = nullptr;
    const double value = std::strtod(start_[i], &end);
    if (end != start_[i] && *end == '\0') return value;
    bad_ = true;
    return std::numeric_limits<double>::quiet_NaN();
  }
  /// Field i; 0, and the line is bad, if that is not one whole number that an `Int` holds.
  template <class Int>
  [[nodiscard]] Int whole(int i) {
    char* end = nullptr;
    errno = 0;
    const long long value = std::strtoll(start_[i], &end, 10);
    if (end != start_[i] && *end == '\0' && errno == 0 &&
        value >= std::numeric_limits<Int>::min() && value <= std::numeric_limits<Int>::max())
      return static_cast<Int>(value);
    bad_ = true;
    return 0;
  }
  /// Whether the line, or a field that was asked for, is not what it should be.
  [[nodiscard]] bool bad() const { return bad_; }

 private:
  /// The rest of a line: true if there was none, because the input ended without a newline.
  [[nodiscard]] static bool skip_line() {
    int c = std::getchar();
    const bool ended = c == EOF;
    while (c != '\n' && c != EOF) c = std::getchar();
    return ended;
  }

  char text_[256];
  char kind_ = '?';
  bool bad_ = false;
  const char* start_[most];
  char in_[4096], out_[4096];
};

/// What main returns where its configuration is not accepted.
[[nodiscard]] inline int refused(const char* what) {
  std::fprintf(stderr, "refused: %s\n", what);
  return 1;
}
