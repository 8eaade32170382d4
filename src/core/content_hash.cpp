#include "tribin/core/content_hash.hpp"

#include <bit>
#include <cstdio>
#include <cstring>

namespace tribin {
namespace {

constexpr std::uint64_t kC1 = 0x87c37b91114253d5, kC2 = 0x4cf5ad432745937f;

std::uint64_t finished(std::uint64_t k) {
  k = (k ^ (k >> 33)) * 0xff51afd7ed558ccd;
  k = (k ^ (k >> 33)) * 0xc4ceb9fe1a85ec53;
  return k ^ (k >> 33);
}

void mix_in(std::uint64_t& h1, std::uint64_t& h2, std::uint64_t k1, std::uint64_t k2) {
  h1 ^= std::rotl(k1 * kC1, 31) * kC2;
  h2 ^= std::rotl(k2 * kC2, 33) * kC1;
}

}  // namespace

ContentHash content_hash(std::string_view bytes, std::uint64_t seed) {
  std::uint64_t h1 = seed, h2 = seed, k[2];
  const std::size_t whole = bytes.size() / 16;
  for (std::size_t i = 0; i < whole; ++i) {
    std::memcpy(k, bytes.data() + 16 * i, 16);
    h1 ^= std::rotl(k[0] * kC1, 31) * kC2;
    h1 = (std::rotl(h1, 27) + h2) * 5 + 0x52dce729;
    h2 ^= std::rotl(k[1] * kC2, 33) * kC1;
    h2 = (std::rotl(h2, 31) + h1) * 5 + 0x38495ab5;
  }
  if (const std::size_t rest = bytes.size() % 16) {
    k[0] = k[1] = 0;
    std::memcpy(k, bytes.data() + 16 * whole, rest);
    mix_in(h1, h2, k[0], k[1]);
  }
  h1 ^= bytes.size();
  h2 ^= bytes.size();
  h1 += h2;
  h2 += h1;
  h1 = finished(h1);
  h2 = finished(h2);
  h1 += h2;
  h2 += h1;
  return {h1, h2};
}

std::string hex_of(const ContentHash& hash) {
  char digits[33];
  std::snprintf(digits, sizeof digits, "%016llx%016llx", static_cast<unsigned long long>(hash[0]),
                static_cast<unsigned long long>(hash[1]));
  return digits;
}

}  // namespace tribin
