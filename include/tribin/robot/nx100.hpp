#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tribin/robot/controller.hpp"
#include "tribin/robot/link.hpp"

/// Host control of the NX100 over TCP (and of later controllers that speak it): lines of text, ended by CR or CR LF.
namespace tribin::robot {

namespace nx100 {

/// "HOSTCTRL_REQUEST <command> <size>\r\n"; the size counts the data's closing CR, and is 0 without data.
std::string request(std::string_view command, std::string_view data);
/// "CONNECT Robot_access Keep-Alive:<count>\r\n"; -1 = no limit.
std::string start_request(int count);
bool is_start_answer(std::string_view line);

/// How a command ended, from the line after "OK:".
struct Ending {
  std::optional<int> error;  ///< message number of an ERROR line
  std::string data;          ///< the line itself otherwise
};
Ending ending_of(std::string_view line);
/// The command that an "OK:" line repeats; none for other lines.
std::optional<std::string> accepted_command(std::string_view line);

/// Decimals of angles: 2 on the NX100, 4 on DX100 and later.
struct Format {
  int angle_decimals = 2;
};
std::string movj_data(double speed_percent, const CartesianPosition& to, const Format& format = {});
std::string movl_data(double speed_mm_s, const CartesianPosition& to, const Format& format = {});
std::string imov_data(double speed_mm_s, const CartesianPosition& by, const Format& format = {});
std::string pmovj_data(double speed_percent, const PulsePosition& to);
/// A user frame by three positions: its origin, a point on +X, one in the X-Y plane.
std::string wuframe_data(int frame, const CartesianPosition& org, const CartesianPosition& xx,
                         const CartesianPosition& xy, int tool, const Format& format = {});

enum class VariableType { byte = 0, integer = 1, double_integer = 2, real = 3, position = 4 };
std::string savev_data(VariableType type, int number);
std::string loadv_data(VariableType type, int number, double value);
std::string loadv_data(int number, const PositionVariable& value, const Format& format = {});

/// Numbers between commas; blanks and + signs do not matter. \return none where one is no finite number
std::optional<std::vector<double>> numbers_of(std::string_view line);
std::optional<ControllerStatus> status_of(std::string_view line);
std::optional<CartesianPosition> position_of(std::string_view line, int frame);
std::optional<ControllerAlarms> alarms_of(std::string_view line);
std::optional<RunningJob> job_of(std::string_view line);
std::optional<PositionVariable> position_variable_of(std::string_view line);

/// Whether an NX100 takes it as a job's name: at most 8 of A-Z, 0-9, - and _.
bool is_job_name(std::string_view name);

/// Cuts a stream into lines: a line ends at CR, and one LF that follows is dropped whenever it comes.
class LineReader {
 public:
  /// A line longer than this is garbage.
  static constexpr std::size_t kLongestLine = 1024;
  void add(std::string_view bytes) { buffer_ += bytes; }
  /// The next whole line, without its end. Empty lines are left out.
  std::optional<std::string> next();
  bool overlong() const { return buffer_.size() > kLongestLine; }
  void clear() { buffer_.clear(); }

 private:
  std::string buffer_;
};

}  // namespace nx100

struct Nx100Options {
  double connect_timeout_s = 2;
  double answer_timeout_s = 2;
  double start_timeout_s = 5;  ///< of START
  int read_attempts = 3;       ///< of commands that only read, and of HOLD 1
  nx100::Format format;
};

/// \param stream, clock  the link; the clock must outlive the client
/// \param sink           takes every byte; may be empty
std::unique_ptr<Controller> make_nx100(std::unique_ptr<ByteStream> stream, Clock& clock,
                                       const Nx100Options& options = {}, ByteSink sink = {});

}  // namespace tribin::robot
