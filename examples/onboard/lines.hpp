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

  /// False at the end of the input, or where nothing can be written any more; what was written goes
  /// out before the wait. What is no line of ours, or too long to be one, has the kind '?'.
  [[nodiscard]] bool next() {
    if (std::fflush(stdout) != 0) return false;
    std::size_t length = 0;
    bool readable = true;
    int c = std::getchar();
    if (c == EOF) return false;
    for (; c != '\n' && c != EOF; c = std::getchar()) {
      readable = readable && c != '\0' && length + 1 < sizeof text_;
      if (readable) text_[length++] = static_cast<char>(c);
    }
    if (length > 0 && text_[length - 1] == '\r') --length;
    text_[readable ? length : 0] = '\0';
    kind_ = text_[0] != '\0' && (text_[1] == ',' || text_[1] == '\0') ? text_[0] : '?';
    bad_ = kind_ == '?';
    fields_ = 0;
    char* at = std::strchr(text_, ',');
    for (const char*& start : start_) {
      start = "";
      if (at == nullptr) continue;
      *at++ = '\0';
      start = at;
      ++fields_;
      at = std::strchr(at, ',');
    }
    if (at != nullptr) ++fields_;  // more than any line of ours has
    return true;
  }
  /// Whether the line is of this kind; it is bad if it then has not so many fields.
  [[nodiscard]] bool is(char kind, int fields) {
    if (kind_ != kind) return false;
    bad_ = bad_ || fields_ != fields;
    return true;
  }

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

  /// What main returns: 0 if all was read and written.
  [[nodiscard]] static int finish() {
    if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0 && std::ferror(stdin) == 0) return 0;
    std::fprintf(stderr, "input or output failed\n");
    return 1;
  }

 private:
  char text_[256];
  char kind_ = '?';
  bool bad_ = false;
  int fields_ = 0;
  const char* start_[most];
  char in_[4096], out_[4096];
};

/// What main returns where its configuration is not accepted.
[[nodiscard]] inline int refused(const char* what) {
  std::fprintf(stderr, "refused: %s\n", what);
  return 1;
}
