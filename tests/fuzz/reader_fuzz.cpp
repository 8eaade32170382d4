// libFuzzer target of one family of readers, named by TRIBIN_FUZZ_FAMILY when it is built: any bytes give a result or a
// tribin::Error. Run as  build/fuzz/tests/fuzz/fuzz_pcd -max_len=65536 -rss_limit_mb=1024 CORPUS
#include "support/parse_any.hpp"

extern "C" int LLVMFuzzerTestOneInput(const unsigned char* bytes, std::size_t size) {
  if (size == 0) return 0;  // read_file refuses what is empty before any parser sees it
  try {
    tribin::test::parse_any(TRIBIN_FUZZ_FAMILY, {"fuzz", std::string(reinterpret_cast<const char*>(bytes), size)});
  } catch (const tribin::Error& error) {
    if (error.code() == tribin::ErrorCode::internal) throw;
  }
  return 0;
}
