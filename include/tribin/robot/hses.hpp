#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "tribin/robot/controller.hpp"
#include "tribin/robot/link.hpp"

/// The High-Speed Ethernet Server of DX100 to YRC1000: packets of UDP, port 10040 (robot) and 10041 (files).
namespace tribin::robot {

namespace hses {

inline constexpr int kHeaderSize = 32;
inline constexpr int kLargestData = 0x1DF;

enum class Division : std::uint8_t { robot = 1, file = 2 };
enum class Service : std::uint8_t {
  get_all = 0x01,
  set_all = 0x02,
  get_one = 0x0E,
  set_one = 0x10,
  file_delete = 0x09,
  file_list = 0x32,
};

struct Request {
  Division division = Division::robot;
  std::uint8_t id = 0;
  std::uint32_t block = 0;
  bool acknowledges = false;  ///< of a block of a file
  std::uint16_t command = 0, instance = 0;
  std::uint8_t attribute = 0;
  Service service = Service::get_all;
  std::string data;
};

struct Answer {
  Division division = Division::robot;
  std::uint8_t id = 0;
  std::uint32_t block = 0;
  std::uint8_t service = 0;  ///< of the request
  std::uint8_t status = 0;   ///< 0 fine, 0x08 command, 0x09 element, 0x1F see `added`
  std::uint16_t added = 0;   ///< message number as hex digits (0x2060)
  std::string data;
};

std::string bytes_of(const Request& request);
std::string bytes_of(const Answer& answer);
/// \return none for what is no such packet
std::optional<Request> request_of(std::string_view bytes);
std::optional<Answer> answer_of(std::string_view bytes);

/// Little-endian numbers, added to and taken from a packet's data.
void put32(std::string& data, std::int64_t value);
std::int32_t get32(std::string_view data, std::size_t index);

/// 13 numbers of a P variable or of the position: data type (0 pulses, 16 base, 17 robot), form, tool, user frame,
/// extended form, 8 values in pulses, micrometres and 0.0001 deg.
std::string position_data(const PositionVariable& position);
std::optional<PositionVariable> position_of(std::string_view data);

/// The first three form bits stand in the other order here.
int hses_form(int form_bits);
int form_bits_of(int hses_form);

/// 104 bytes of a linear move; speed in mm/s. The client does not use it: the arm is driven by a job.
std::string move_data(double speed_mm_s, const CartesianPosition& to);

/// Message numbers: 2060 <-> 0x2060.
int decimal_digits(int hex);
int hex_digits(int decimal);

}  // namespace hses

struct HsesOptions {
  double answer_timeout_s = 0.3;
  int read_attempts = 5;  ///< of what only reads, and of HOLD on; nothing else is repeated
};

/// \param link   to port 10040. \param files  to port 10041, for delete_job; may be none
std::unique_ptr<Controller> make_hses(std::unique_ptr<DatagramLink> link, Clock& clock, const HsesOptions& options = {},
                                      ByteSink sink = {}, std::unique_ptr<DatagramLink> files = {});

}  // namespace tribin::robot
