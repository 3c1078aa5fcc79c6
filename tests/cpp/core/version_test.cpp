#include "surefix/version.hpp"

#include <gtest/gtest.h>

#include <string>

namespace surefix {
namespace {

TEST(Version, IsThatOfTheLibraryAndInNumbers) {
  const BuildFacts facts = build_facts();
  EXPECT_STREQ(facts.version, version);
  EXPECT_EQ(std::to_string(SUREFIX_VERSION_MAJOR) + "." + std::to_string(SUREFIX_VERSION_MINOR) +
                "." + std::to_string(SUREFIX_VERSION_PATCH),
            version);
  EXPECT_TRUE(fits_library());
}

TEST(Version, SaysHowTheLibraryWasBuilt) {
  const BuildFacts facts = build_facts();
  EXPECT_GE(facts.standard, 201703L);
  EXPECT_GE(facts.max_align, 0);
  EXPECT_EQ(std::string(facts.eigen).rfind("3.", 0), 0u);
  EXPECT_GT(std::string(facts.compiler).size(), 4u);
}

}  // namespace
}  // namespace surefix
