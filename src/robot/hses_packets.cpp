#include <cmath>

#include "tribin/robot/hses.hpp"

namespace tribin::robot::hses {
namespace {

void put16(std::string& out, unsigned value) {
  out += static_cast<char>(value & 0xff);
  out += static_cast<char>(value >> 8 & 0xff);
}

unsigned get8(std::string_view bytes, std::size_t at) { return static_cast<unsigned char>(bytes[at]); }
unsigned get16(std::string_view bytes, std::size_t at) { return get8(bytes, at) | get8(bytes, at + 1) << 8; }
std::uint32_t get_u32(std::string_view bytes, std::size_t at) {
  return get16(bytes, at) | static_cast<std::uint32_t>(get16(bytes, at + 2)) << 16;
}

constexpr unsigned kReserved = 3;
constexpr std::string_view kMagic = "YERC";
constexpr std::string_view kNines = "99999999";
constexpr std::size_t kAnswerBit = 0x80;

std::string head(std::size_t data_size, Division division, bool answer, std::uint8_t id, std::uint32_t block) {
  std::string out(kMagic);
  put16(out, kHeaderSize);
  put16(out, static_cast<unsigned>(data_size));
  out += static_cast<char>(kReserved);
  out += static_cast<char>(division);
  out += static_cast<char>(answer);
  out += static_cast<char>(id);
  put32(out, block);
  out += kNines;
  return out;
}

/// Whether it has the form of a packet, its data whole.
bool is_packet(std::string_view bytes) {
  return bytes.size() >= kHeaderSize && bytes.substr(0, 4) == kMagic && get16(bytes, 4) == kHeaderSize &&
         get16(bytes, 6) <= kLargestData && bytes.size() == kHeaderSize + get16(bytes, 6) &&
         (get8(bytes, 9) == 1 || get8(bytes, 9) == 2) && get8(bytes, 10) <= 1;
}

// Lengths in micrometres, angles in 0.0001 deg.
constexpr double kPerMm = 1000, kPerDeg = 10000;
constexpr int kPulses = 0, kBase = 16, kRobot = 17;

std::int64_t scaled(double value, double scale) {
  const double number = std::round(value * scale);
  if (!(std::abs(number) <= 2147483647.0))
    throw ControllerError(ControllerFault::not_sent, "a number to be sent is not finite or too large");
  return static_cast<std::int64_t>(number);
}

}  // namespace

void put32(std::string& data, std::int64_t value) {
  const auto bits = static_cast<std::uint32_t>(value);
  for (int shift = 0; shift < 32; shift += 8) data += static_cast<char>(bits >> shift & 0xff);
}

std::int32_t get32(std::string_view data, std::size_t index) {
  return static_cast<std::int32_t>(get_u32(data, index * 4));
}

std::string bytes_of(const Request& r) {
  std::string out = head(r.data.size(), r.division, r.acknowledges, r.id, r.block);
  put16(out, r.command);
  put16(out, r.instance);
  out += static_cast<char>(r.attribute);
  out += static_cast<char>(r.service);
  put16(out, 0);
  return out + r.data;
}

std::string bytes_of(const Answer& a) {
  std::string out = head(a.data.size(), a.division, true, a.id, a.block);
  out += static_cast<char>(a.service | kAnswerBit);
  out += static_cast<char>(a.status);
  out += static_cast<char>(a.status == 0 ? 0 : 2);
  out += '\0';
  put16(out, a.added);
  put16(out, 0);
  return out + a.data;
}

std::optional<Request> request_of(std::string_view bytes) {
  if (!is_packet(bytes)) return std::nullopt;
  Request r;
  r.division = static_cast<Division>(get8(bytes, 9));
  r.acknowledges = get8(bytes, 10) == 1;
  r.id = static_cast<std::uint8_t>(get8(bytes, 11));
  r.block = get_u32(bytes, 12);
  r.command = static_cast<std::uint16_t>(get16(bytes, 24));
  r.instance = static_cast<std::uint16_t>(get16(bytes, 26));
  r.attribute = static_cast<std::uint8_t>(get8(bytes, 28));
  r.service = static_cast<Service>(get8(bytes, 29));
  r.data = bytes.substr(kHeaderSize);
  return r;
}

std::optional<Answer> answer_of(std::string_view bytes) {
  if (!is_packet(bytes) || get8(bytes, 10) != 1 || !(get8(bytes, 24) & kAnswerBit)) return std::nullopt;
  Answer a;
  a.division = static_cast<Division>(get8(bytes, 9));
  a.id = static_cast<std::uint8_t>(get8(bytes, 11));
  a.block = get_u32(bytes, 12);
  a.service = static_cast<std::uint8_t>(get8(bytes, 24) & ~kAnswerBit);
  a.status = static_cast<std::uint8_t>(get8(bytes, 25));
  a.added = get8(bytes, 26) ? static_cast<std::uint16_t>(get16(bytes, 28)) : std::uint16_t{0};
  a.data = bytes.substr(kHeaderSize);
  return a;
}

int hses_form(int form) { return (form & ~7) | (form & 1) << 2 | (form & 2) | (form >> 2 & 1); }
int form_bits_of(int form) { return hses_form(form) & 63; }

std::string position_data(const PositionVariable& position) {
  std::string data;
  if (const auto* pulses = std::get_if<PulsePosition>(&position)) {
    for (const int number : {kPulses, 0, pulses->tool, 0, 0}) put32(data, number);
    for (std::size_t i = 0; i < 8; ++i) put32(data, i < pulses->pulses.size() ? pulses->pulses[i] : 0);
    return data;
  }
  const auto& p = std::get<CartesianPosition>(position);
  // Public sources disagree on the numbers of user and tool frames.
  if (p.frame != 0 && p.frame != 1)
    throw ControllerError(ControllerFault::not_sent,
                          "saw frame " + std::to_string(p.frame) + ", wanted 0 (base) or 1 (robot) over this protocol");
  for (const int number : {p.frame == 0 ? kBase : kRobot, hses_form(p.type), p.tool, 0, 0}) put32(data, number);
  for (int i = 0; i < 6; ++i) put32(data, scaled(p.numbers[i], i < 3 ? kPerMm : kPerDeg));
  put32(data, scaled(p.elbow_deg, kPerDeg));
  put32(data, 0);
  return data;
}

std::optional<PositionVariable> position_of(std::string_view data) {
  if (data.size() != 13 * 4) return std::nullopt;
  const int kind = get32(data, 0), tool = get32(data, 2);
  if (tool < 0 || tool > 63) return std::nullopt;
  if (kind == kPulses) {
    PulsePosition pulses{{}, tool};
    for (std::size_t i = 0; i < 8; ++i) pulses.pulses.push_back(get32(data, 5 + i));
    return pulses;
  }
  if (kind != kBase && kind != kRobot) return std::nullopt;
  CartesianPosition p;
  p.frame = kind == kBase ? 0 : 1;
  p.type = form_bits_of(get32(data, 1));
  p.tool = tool;
  for (int i = 0; i < 6; ++i) p.numbers[i] = get32(data, 5 + i) / (i < 3 ? kPerMm : kPerDeg);
  p.elbow_deg = get32(data, 11) / kPerDeg;
  return p;
}

std::string move_data(double speed_mm_s, const CartesianPosition& to) {
  constexpr int kMmPerSecond = 1;  // speed class, in 0.1 mm/s
  std::string data;
  for (const std::int64_t n : {std::int64_t{1}, std::int64_t{0}, std::int64_t{kMmPerSecond}, scaled(speed_mm_s, 10),
                               std::int64_t{to.frame == 0 ? kBase : kRobot}})
    put32(data, n);
  for (int i = 0; i < 6; ++i) put32(data, scaled(to.numbers[i], i < 3 ? kPerMm : kPerDeg));
  put32(data, scaled(to.elbow_deg, kPerDeg));
  for (const int n : {0, hses_form(to.type), 0, to.tool, 0}) put32(data, n);
  data.resize(104, '\0');
  return data;
}

int decimal_digits(int hex) {
  int out = 0;
  for (int shift = 12; shift >= 0; shift -= 4) {
    const int digit = hex >> shift & 15;
    if (digit > 9) return 0;  // A000, B001, ...: of the protocol itself
    out = out * 10 + digit;
  }
  return out;
}

int hex_digits(int decimal) {
  int out = 0;
  for (int shift = 0; shift < 16; shift += 4, decimal /= 10) out |= decimal % 10 << shift;
  return out;
}

}  // namespace tribin::robot::hses
