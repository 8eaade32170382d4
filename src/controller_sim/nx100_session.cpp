#include <charconv>
#include <utility>

#include "tribin/controller_sim/sessions.hpp"

namespace tribin::controller_sim {
namespace {

constexpr std::size_t kLongest = 1024;  // of a line and of a command's data
constexpr double kSegment_s = 0.002;    // between segments that a fault splits

std::string trimmed(std::string_view text) {
  constexpr std::string_view kBlanks(" \t\r\n\0", 5);
  const std::size_t first = text.find_first_not_of(kBlanks.substr(0, 4));
  if (first == std::string_view::npos) return {};
  return std::string(text.substr(first, text.find_last_not_of(kBlanks.substr(0, 4)) - first + 1));
}

std::optional<long> whole(std::string_view text) {
  long value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (text.empty() || error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

}  // namespace

void Nx100Session::send(const std::string& bytes, double delay_s) {
  send_at_ = std::max(send_at_, wire_.machine.now_s()) + delay_s;
  if (fault_ == Fault::split_answer) {
    for (const char byte : bytes) {
      out_.push_back({send_at_, std::string(1, byte), false});
      send_at_ += kSegment_s;
    }
  } else if (fault_ == Fault::late_lf && bytes.ends_with("\r\n")) {
    out_.push_back({send_at_, bytes.substr(0, bytes.size() - 1), false});
    send_at_ += 0.05;
    out_.push_back({send_at_, "\n", false});
  } else {
    out_.push_back({send_at_, bytes, false});
  }
}

void Nx100Session::close() {
  if (closed_) return;
  closed_ = true;
  out_.push_back({std::max(send_at_, wire_.machine.now_s()), {}, true});
}

bool Nx100Session::idle_over() const {
  return wire_.dice.has(Fault::idle_close) && wire_.machine.now_s() - last_s_ > wire_.dice.plan().idle_s;
}

std::vector<Chunk> Nx100Session::receive(std::string_view bytes) {
  last_s_ = wire_.machine.now_s();
  while (!bytes.empty() && !closed_) {
    // Piece by piece, so that the buffer never grows beyond what one line and one command's data take.
    const std::string_view piece = bytes.substr(0, kLongest);
    bytes.remove_prefix(piece.size());
    buffer_ += piece;
    while (!closed_) {
      if (!buffer_.empty() && buffer_.front() == '\n') {
        buffer_.erase(0, 1);
        continue;
      }
      if (!pending_.empty()) {
        if (static_cast<long>(buffer_.size()) < pending_size_) break;
        const std::string data = trimmed(buffer_.substr(0, static_cast<std::size_t>(pending_size_)));
        buffer_.erase(0, static_cast<std::size_t>(pending_size_));
        const std::string name = std::move(pending_);
        pending_.clear();
        command(name, data, true);
        continue;
      }
      const std::size_t end = buffer_.find('\r');
      if (end == std::string::npos) {
        if (buffer_.size() > kLongest) {
          send("NG: HTTP Error Response\r\n");
          close();
        }
        break;
      }
      const std::string text = trimmed(buffer_.substr(0, end));
      buffer_.erase(0, end + 1);
      if (!text.empty()) line(text);
    }
  }
  if (closed_) buffer_.clear();
  return std::exchange(out_, {});
}

void Nx100Session::line(const std::string& text) {
  if (!started_) return start(text);
  const std::size_t space = text.find(' '), last = text.rfind(' ');
  const std::string word = text.substr(0, space);
  const long size = last == std::string::npos ? -1 : whole(std::string_view(text).substr(last + 1)).value_or(-1);
  const std::string name = last > space ? trimmed(text.substr(space, last - space)) : "";
  if (word != "HOSTCTRL_REQUEST" || size < 0 || size > static_cast<long>(kLongest) || name.empty()) {
    send("NG: Bad Request\r\n");
    return close();
  }
  fault_ = wire_.dice.throw_dice();
  if (fault_ == Fault::ng || (wire_.unknown_is_ng && !is_nx100_command(name))) {
    send("NG: " + name + "\r\n");
    return close();
  }
  if (fault_ == Fault::drop_before) return close();
  if (size == 0) return command(name, {}, false);
  send("OK: " + name + "\r\n");
  pending_ = name;
  pending_size_ = size;
}

void Nx100Session::start(const std::string& text) {
  constexpr std::string_view kWord = "CONNECT Robot_access";
  std::string rest = text.starts_with(kWord) ? trimmed(std::string_view(text).substr(kWord.size())) : "x";
  long count = 1;
  for (const std::string_view keyword : {"Keep-Alive:", "KeepAlive:"})
    if (rest.starts_with(keyword)) {
      count = whole(trimmed(std::string_view(rest).substr(keyword.size()))).value_or(0);
      rest.clear();
      if (count != -1 && (count < 2 || count > 32767)) rest = "x";
    }
  if (!rest.empty()) {
    send("NG: HTTP Error Response\r\n");
    return close();
  }
  started_ = true;
  commands_left_ = static_cast<int>(count);
  const std::string alive = count == 1 ? "." : " Keep-Alive:" + std::to_string(count) + ".";
  if (wire_.dice.has(Fault::odd_version))
    send("OK:YR Information Server(2.03-00 beta)\r\n");
  else
    send("OK: NX Information Server( 1.16)" + alive + "\r\n");
}

void Nx100Session::command(const std::string& name, const std::string& data, bool with_data) {
  const CommandAnswer answer = nx100_answer(wire_, name, data, fault_);
  ++wire_.commands;
  ++commands_;
  if (fault_ == Fault::drop_after) return close();
  std::string line = answer.data.empty() ? "0000\r\n" : answer.data + "\r";
  if (answer.error != 0) {
    const std::string shown = fault_ == Fault::bracket_error ? "[" + name + "]" : " " + name;
    line = "ERROR:" + shown + " is not successful(" + std::to_string(answer.error) + ").\r\n";
  }
  double delay_s = answer.delay_s;
  if (fault_ == Fault::delayed_answer) delay_s += 2 * wire_.dice.uniform() * wire_.dice.plan().delay_s;
  if (with_data) {
    send(line, delay_s);
  } else if (delay_s > 0 || fault_ == Fault::separate_answer) {
    send("OK: " + name + "\r\n");
    send(line, std::max(delay_s, kSegment_s));
  } else {
    send("OK: " + name + "\r\n" + line);
  }
  fault_.reset();
  if (commands_left_ > 0 && --commands_left_ == 0) close();
  if (wire_.dice.has(Fault::close_after) && commands_ >= wire_.dice.plan().close_after) close();
}

}  // namespace tribin::controller_sim
