// Lines of comma-separated numbers from standard input, and no heap: what stands for the bus of a
// vehicle in these examples.
#pragma once

#include <cstdio>
#include <cstdlib>

/// One line: a letter that says what it is, then numbers. "M,1200000000,0,19.5".
class Lines {
 public:
  static constexpr int most = 8;

  Lines() {
    std::setvbuf(stdin, in_, _IOFBF, sizeof in_);
    std::setvbuf(stdout, out_, _IOFBF, sizeof out_);
  }

  /// False at the end of the input. What is no line of ours has the kind '?'; missing numbers are
  /// 0.
  [[nodiscard]] bool next() {
    if (std::fgets(text_, sizeof text_, stdin) == nullptr) return false;
    char* at = text_;
    kind_ = at[0] != '\0' && (at[1] == ',' || at[1] == '\n' || at[1] == '\0') ? at[0] : '?';
    for (int i = 0; i < most; ++i) {
      start_[i] = "";
      while (*at != '\0' && *at != ',') ++at;
      if (*at == ',') start_[i] = ++at;
    }
    return true;
  }
  [[nodiscard]] char kind() const { return kind_; }
  [[nodiscard]] double number(int i) const { return std::strtod(start_[i], nullptr); }
  [[nodiscard]] long long whole(int i) const { return std::strtoll(start_[i], nullptr, 10); }

 private:
  char text_[256];
  char kind_ = '?';
  const char* start_[most];
  char in_[4096], out_[4096];
};
