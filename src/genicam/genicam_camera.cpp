#include "tribin/genicam/genicam_camera.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>

#include "genicam/aravis.hpp"
#include "genicam/buffers.hpp"

namespace tribin::genicam {
namespace {

constexpr const char* kTriggers[] = {"free_run", "software", "software_burst", "hardware"};

/// Patterns in a row that are taken with one exposure.
struct Group {
  std::size_t begin = 0, end = 0;
  double exposure_ms = 0;
};

std::vector<Group> groups_of(const std::vector<Pattern>& patterns, double exposure_ms) {
  std::vector<Group> groups;
  for (std::size_t i = 0; i < patterns.size(); ++i) {
    const double exposure = patterns[i].exposure_ms > 0 ? patterns[i].exposure_ms : exposure_ms;
    if (groups.empty() || groups.back().exposure_ms != exposure) groups.push_back({i, i, exposure});
    groups.back().end = i + 1;
  }
  return groups;
}

/// Buffers come in order; an id left out is a picture that was lost on the way, and all after it would be taken for
/// their neighbours. GigE Vision counts 1 .. 65535 and begins again; 0 is no id.
bool follows(guint64 id, guint64 last) { return id == 0 || last == 0 || id == last + 1 || (last == 65535 && id == 1); }

class GenicamCamera : public Camera {
 public:
  explicit GenicamCamera(const GenicamOptions& options) : options_(options) {
    name_ = "genicam" + (options.id.empty() ? "" : ":" + options.id);
    if (!options.sequence.patterns.empty() && options.trigger == Trigger::free_run)
      throw Error(ErrorCode::bad_option, name_ +
                                             ": saw the trigger free_run with patterns, wanted hardware, software "
                                             "or software_burst: pictures and patterns must go together");
    // A camera that is busy answers its first questions late, and Aravis gives up after half a second.
    constexpr int kTries = 3;
    for (int i = 1; !camera_; ++i) {
      try {
        camera_.reset(call(name_, "no such camera, or it is in use", arv_camera_new,
                           options.id.empty() ? nullptr : options.id.c_str()));
      } catch (const Error&) {
        if (i == kTries) throw;
      }
    }
    if (options.id.empty())
      name_ += std::string(":") + call(name_, "its name", arv_camera_get_device_id, camera_.get());
    lost_signal_ = g_signal_connect(device(), "control-lost", G_CALLBACK(&GenicamCamera::on_lost), this);
    if (arv_camera_is_gv_device(camera_.get())) {
      if (!options.packet_socket)
        arv_camera_gv_set_stream_options(camera_.get(), ARV_GV_STREAM_OPTION_PACKET_SOCKET_DISABLED);
      if (options.packet_size > 0) {
        arv_camera_gv_set_packet_size_adjustment(camera_.get(), ARV_GV_PACKET_SIZE_ADJUSTMENT_NEVER);
        call(name_, "--packet-size", arv_camera_gv_set_packet_size, camera_.get(), options.packet_size);
      }
    }
    stream_.reset(call(name_, "no stream", arv_camera_create_stream, camera_.get(), nullptr, nullptr));
  }

  ~GenicamCamera() override {
    if (camera_) g_signal_handler_disconnect(device(), lost_signal_);
  }

  std::string name() const override { return name_; }

  Shot grab() override {
    int incomplete = 0;
    for (int attempt = 0; attempt <= options_.retries; ++attempt) {
      Shot shot;
      shot.taken = options_.taken;
      shot.taken.time_ms = now_ms();
      if (shot.taken.base_from_flange) shot.taken.flange_time_ms = shot.taken.time_ms;
      if (!take(shot, incomplete)) continue;
      if (incomplete > 0)
        shot.warnings.push_back(name_ + ": " + std::to_string(incomplete) + " incomplete or lost picture" +
                                (incomplete == 1 ? "" : "s") + ", taken again");
      return shot;
    }
    throw Error(ErrorCode::device, name_ + ": saw incomplete or lost pictures in each of " +
                                       std::to_string(options_.retries + 1) + " attempts (" +
                                       std::to_string(incomplete) +
                                       " in all), wanted whole ones: look at cable, network load and packet size");
  }

 private:
  static void on_lost(ArvDevice*, GenicamCamera* self) { self->lost_ = true; }
  ArvDevice* device() const { return arv_camera_get_device(camera_.get()); }

  /// One attempt. \return whether all pictures came whole.
  bool take(Shot& shot, int& incomplete) {
    if (options_.sequence.patterns.empty()) {
      std::vector<Owned<ArvBuffer>> buffers = burst({0, 1, options_.exposure_ms}, incomplete);
      if (buffers.empty()) return false;
      shot.content = scan_of_buffer(name_, camera_.get(), buffers[0].get());
      return true;
    }
    FrameStack stack = options_.sequence;
    for (const Group& group : groups_of(stack.patterns, options_.exposure_ms)) {
      const std::vector<Owned<ArvBuffer>> buffers = burst(group, incomplete);
      if (buffers.empty()) return false;
      for (const Owned<ArvBuffer>& buffer : buffers) append_picture(name_, buffer.get(), stack);
    }
    shot.content = std::vector<FrameStack>{std::move(stack)};
    return true;
  }

  void arm(const Group& group) {
    ArvCamera* camera = camera_.get();
    const auto count = static_cast<gint64>(group.end - group.begin);
    if (group.exposure_ms > 0) call(name_, "exposure", arv_camera_set_exposure_time, camera, 1000 * group.exposure_ms);
    call(name_, "acquisition mode", arv_camera_set_acquisition_mode, camera, ARV_ACQUISITION_MODE_CONTINUOUS);
    switch (options_.trigger) {
      case Trigger::free_run:
        return call(name_, "triggers off", arv_camera_clear_triggers, camera);
      case Trigger::software:
        return call(name_, "software trigger", arv_camera_set_trigger, camera, "Software");
      case Trigger::hardware:
        return call(name_, "trigger on " + options_.line, arv_camera_set_trigger, camera, options_.line.c_str());
      case Trigger::software_burst:
        call(name_, "triggers off", arv_camera_clear_triggers, camera);
        call(name_, "burst trigger", arv_camera_set_string, camera, "TriggerSelector", "FrameBurstStart");
        call(name_, "burst trigger", arv_camera_set_string, camera, "TriggerMode", "On");
        call(name_, "burst trigger", arv_camera_set_string, camera, "TriggerSource", "Software");
        call(name_, "length of the burst", arv_camera_set_integer, camera, "AcquisitionBurstFrameCount", count);
    }
  }

  /// The buffers of a group, or none where one of them is not whole. Time-outs of a camera that gives nothing throw.
  std::vector<Owned<ArvBuffer>> burst(const Group& group, int& incomplete) {
    check_there();
    arm(group);
    const guint payload = call(name_, "size of a picture", arv_camera_get_payload, camera_.get());
    const std::size_t count = group.end - group.begin;
    while (ArvBuffer* old = arv_stream_try_pop_buffer(stream_.get())) g_object_unref(old);  // of an attempt before
    gint waiting = 0, done = 0;  // an attempt that was broken off left buffers in the stream: they serve again
    arv_stream_get_n_buffers(stream_.get(), &waiting, &done);
    for (std::size_t i = static_cast<std::size_t>(std::max(0, waiting)); i < count; ++i)
      arv_stream_push_buffer(stream_.get(), arv_buffer_new_allocate(payload));
    call(name_, "start", arv_camera_start_acquisition, camera_.get());
    const struct Stop {
      ArvCamera* camera;
      ~Stop() { arv_camera_stop_acquisition(camera, nullptr); }
    } stop{camera_.get()};
    std::vector<Owned<ArvBuffer>> buffers;
    guint64 last = 0;
    for (std::size_t i = 0; i < count; ++i) {
      if (options_.trigger == Trigger::software || (options_.trigger == Trigger::software_burst && i == 0))
        call(name_, "software trigger", arv_camera_software_trigger, camera_.get());
      Owned<ArvBuffer> buffer = pop(group, i);
      const bool whole = buffer && arv_buffer_get_status(buffer.get()) == ARV_BUFFER_STATUS_SUCCESS;
      const guint64 id = whole ? arv_buffer_get_frame_id(buffer.get()) : 0;
      if (!whole || !follows(id, last)) {
        ++incomplete;
        return {};
      }
      last = id;
      buffers.push_back(std::move(buffer));
    }
    return buffers;
  }

  /// The next buffer; none where the camera stopped amid a burst: a trigger or a picture was lost.
  Owned<ArvBuffer> pop(const Group& group, std::size_t index) {
    using clock = std::chrono::steady_clock;
    constexpr guint64 kSliceUs = 50'000;  // between looks whether the camera is still there
    const double seconds = options_.timeout_s + group.exposure_ms / 1000;
    const auto end = clock::now() + std::chrono::duration_cast<clock::duration>(std::chrono::duration<double>(seconds));
    do {
      if (ArvBuffer* buffer = arv_stream_timeout_pop_buffer(stream_.get(), kSliceUs)) return Owned<ArvBuffer>(buffer);
      check_there();
    } while (clock::now() < end);
    if (index > 0) return nullptr;
    char text[32];
    std::snprintf(text, sizeof text, "%g s", seconds);
    throw Error(ErrorCode::device, name_ + ": saw no picture in " + text + ", wanted one" +
                                       (options_.trigger == Trigger::hardware
                                            ? ": does the projector run, and is its trigger on " + options_.line + "?"
                                            : ": is its network open, and the packet size one that it carries?"));
  }

  void check_there() const {
    if (lost_)
      throw Error(ErrorCode::device, name_ +
                                         ": the camera no longer answers (unplugged, switched off, or taken over "
                                         "by another program); wanted it to stay");
  }

  GenicamOptions options_;
  std::string name_;
  std::atomic<bool> lost_{false};
  gulong lost_signal_ = 0;
  Owned<ArvCamera> camera_;
  Owned<ArvStream> stream_;
};

}  // namespace

Trigger trigger_of(const std::string& name) {
  for (std::size_t i = 0; i < std::size(kTriggers); ++i)
    if (name == kTriggers[i]) return static_cast<Trigger>(i);
  throw Error(ErrorCode::bad_option,
              "--trigger: saw \"" + name + "\", wanted free_run, software, software_burst or hardware");
}

std::unique_ptr<Camera> open_genicam_camera(const GenicamOptions& options) {
  return std::make_unique<GenicamCamera>(options);
}

}  // namespace tribin::genicam
