#include "tribin/genicam/genicam_camera.hpp"

#include <arv.h>
#include <gtest/gtest.h>

#include "tribin/core/error.hpp"

namespace tribin::genicam {
namespace {

/// Aravis' simulated GigE Vision camera on the loopback, in this process.
class FakeCamera : public testing::Test {
 protected:
  void SetUp() override {
    fake_ = arv_gv_fake_camera_new("127.0.0.1", "tribin");
    if (!arv_gv_fake_camera_is_running(fake_)) GTEST_SKIP() << "the loopback cannot carry a simulated camera here";
    // Small pictures: a socket's buffer holds them whole, however busy the machine is.
    ArvFakeCamera* inside = arv_gv_fake_camera_get_fake_camera(fake_);
    arv_fake_camera_write_register(inside, ARV_FAKE_CAMERA_REGISTER_WIDTH, 128);
    arv_fake_camera_write_register(inside, ARV_FAKE_CAMERA_REGISTER_HEIGHT, 96);
  }
  void TearDown() override { unplug(); }
  void unplug() { g_clear_object(&fake_); }

  /// Loopback carries neither packet sockets nor packets of the size that would be negotiated.
  static GenicamOptions options(int pictures) {
    GenicamOptions out;
    out.id = "Aravis-tribin";
    out.packet_socket = false;
    out.packet_size = 1400;
    out.retries = 20;  // a busy machine drops packets
    if (pictures > 0) {
      out.sequence.camera = "fake";
      out.sequence.patterns = make_patterns({.width = 64, .height = 48});
      out.sequence.patterns.resize(static_cast<std::size_t>(pictures));
      out.trigger = Trigger::software;
    }
    return out;
  }

  static ErrorCode code_of(const std::function<void()>& action, std::string* words = nullptr) {
    try {
      action();
    } catch (const Error& e) {
      if (words) *words = e.what();
      return e.code();
    }
    return ErrorCode::internal;
  }

  ArvGvFakeCamera* fake_ = nullptr;
};

TEST_F(FakeCamera, TakesOnePictureAPattern) {
  const auto camera = open_genicam_camera(options(4));
  EXPECT_EQ(camera->name(), "genicam:Aravis-tribin");
  for (int shot = 0; shot < 2; ++shot) {
    const Shot taken = camera->grab();
    const auto& stacks = std::get<std::vector<FrameStack>>(taken.content);
    ASSERT_EQ(stacks.size(), 1u);
    EXPECT_EQ(stacks[0].camera, "fake");
    ASSERT_EQ(stacks[0].grey8.size(), 4u);
    for (const auto& image : stacks[0].grey8) EXPECT_EQ(image.width, stacks[0].grey8[0].width);
    EXPECT_GT(stacks[0].grey8[0].width, 0);
    EXPECT_NE(stacks[0].grey8[0].data, stacks[0].grey8[1].data);  // its test picture moves on
    EXPECT_TRUE(taken.taken.time_ms);
  }
}

TEST_F(FakeCamera, SetsTheExposureOfEachPattern) {
  GenicamOptions o = options(4);
  for (int i = 0; i < 4; ++i) o.sequence.patterns[static_cast<std::size_t>(i)].exposure_ms = i < 2 ? 3 : 7;
  const Shot shot = open_genicam_camera(o)->grab();
  EXPECT_EQ(std::get<std::vector<FrameStack>>(shot.content)[0].grey8.size(), 4u);
}

TEST_F(FakeCamera, TellsWhatIsNotThere) {
  GenicamOptions o = options(1);
  o.id = "Aravis-nobody";
  std::string words;
  EXPECT_EQ(code_of([&] { open_genicam_camera(o); }, &words), ErrorCode::device);
  EXPECT_NE(words.find("Aravis-nobody"), std::string::npos) << words;
  o = options(1);
  o.trigger = Trigger::free_run;
  EXPECT_EQ(code_of([&] { open_genicam_camera(o); }), ErrorCode::bad_option);
  EXPECT_THROW(trigger_of("now"), Error);
}

TEST_F(FakeCamera, PicturesAreNoPoints) {
  std::string words;
  EXPECT_EQ(code_of([&] { open_genicam_camera(options(0))->grab(); }, &words), ErrorCode::bad_input);
  EXPECT_NE(words.find("Coord3D"), std::string::npos) << words;
}

TEST_F(FakeCamera, ATriggerThatNeverComesIsATimeOut) {
  GenicamOptions o = options(2);
  o.trigger = Trigger::hardware;
  o.line = "Software";  // armed, and never fired
  o.timeout_s = 0.3;
  std::string words;
  EXPECT_EQ(code_of([&] { open_genicam_camera(o)->grab(); }, &words), ErrorCode::device);
  EXPECT_NE(words.find("no picture in 0.3 s"), std::string::npos) << words;
  o.line = "Line77";
  EXPECT_EQ(code_of([&] { open_genicam_camera(o)->grab(); }, &words), ErrorCode::device);
  EXPECT_NE(words.find("Line77"), std::string::npos) << words;
}

/// Loses one picture on the way: the ids that the camera sends jump once.
struct Lossy {
  int sent = 0, jumps = 0, lost_at = 3;
};
void send(ArvBuffer* buffer, void* data, guint32, guint32, ArvPixelFormat) {
  auto& lossy = *static_cast<Lossy*>(data);
  if (++lossy.sent == lossy.lost_at) ++lossy.jumps;
  arv_buffer_set_frame_id(buffer, static_cast<guint64>(lossy.sent + lossy.jumps));
}

TEST_F(FakeCamera, ABurstThatLostAPictureIsTakenAgain) {
  Lossy lossy;
  arv_fake_camera_set_fill_pattern(arv_gv_fake_camera_get_fake_camera(fake_), send, &lossy);
  const Shot shot = open_genicam_camera(options(4))->grab();
  EXPECT_EQ(std::get<std::vector<FrameStack>>(shot.content)[0].grey8.size(), 4u);
  ASSERT_EQ(shot.warnings.size(), 1u);
  EXPECT_NE(shot.warnings[0].find("incomplete or lost"), std::string::npos) << shot.warnings[0];
  EXPECT_GE(lossy.sent, 7);  // three, of which the third showed the gap, and four again

  GenicamOptions impatient = options(4);
  impatient.retries = 0;
  lossy.lost_at = lossy.sent + 2;
  EXPECT_EQ(code_of([&] { open_genicam_camera(impatient)->grab(); }), ErrorCode::device);
  unplug();  // before what its callback points to
}

TEST_F(FakeCamera, OneThatIsUnpluggedIsTold) {
  GenicamOptions o = options(2);
  o.timeout_s = 0.5;
  const auto camera = open_genicam_camera(o);
  camera->grab();
  unplug();
  std::string words;
  EXPECT_EQ(code_of([&] { camera->grab(); }, &words), ErrorCode::device);
  EXPECT_NE(words.find("genicam:Aravis-tribin"), std::string::npos) << words;
}

}  // namespace
}  // namespace tribin::genicam
