#include <regex>

#include "tribin/controller_sim/inform.hpp"

namespace tribin::controller_sim {
namespace {

// A test holds the jobs against those of examples/robots.
constexpr const char* kJob = R"(/JOB
//NAME BPICK
//POS
///NPOS 2,0,0,0,0,0
///TOOL 1
///POSTYPE ROBOT
///RECTAN
///RCONF 1,0,0,0,0,0
C00000=600.000,0.000,500.000,180.00,0.00,0.00
C00001=600.000,-400.000,500.000,180.00,0.00,0.00
//INST
///DATE 2026/01/31 12:00
///COMM VISION PICK
///ATTR SC,RW
///GROUP1 RB1
NOP
'B000 1 PICK 2 PLACE 3 PUT BACK
'     4 WAY POINTS, B004 OF THEM
'B001 0 IDLE 1 TAKEN 2 DONE
'B003 1 DONE 2 NO GRIP 3 FAULT
'     4 PART LOST
'I000 CYCLE I001 TAKEN I002 DONE
SET B000 0
SET B001 0
*WAIT
JUMP *PICK IF B000=1
JUMP *PLACE IF B000=2
JUMP *BACK IF B000=3
JUMP *WAY IF B000=4
TIMER T=0.05
JUMP *WAIT
*PICK
'NEVER THE SAME CYCLE TWICE
JUMP *STALE IF I000=I002
SET I001 I000
SET B001 1
MOVJ P001 VJ=20.00 PL=0
MOVL P002 V=100.0 PL=0
DOUT OT#(1) ON
TIMER T=0.30
MOVL P003 V=200.0 PL=0
SET B003 1
JUMP *DONE IF IN#(1)=ON
SET B003 2
DOUT OT#(1) OFF
JUMP *DONE
*PLACE
JUMP *STALE IF I000=I002
SET I001 I000
SET B001 1
MOVJ P004 VJ=20.00 PL=0
MOVL P005 V=100.0 PL=0
SET B003 4
JUMP *DONE IF IN#(1)=OFF
DOUT OT#(1) OFF
TIMER T=0.20
MOVL P006 V=200.0 PL=0
SET B003 1
JUMP *DONE
*BACK
JUMP *STALE IF I000=I002
SET I001 I000
SET B001 1
MOVJ P001 VJ=20.00 PL=0
MOVL P002 V=100.0 PL=0
SET B003 4
JUMP *DONE IF IN#(1)=OFF
DOUT OT#(1) OFF
TIMER T=0.20
MOVL P003 V=200.0 PL=0
SET B003 1
JUMP *DONE
*WAY
JUMP *STALE IF I000=I002
SET I001 I000
SET B001 1
SET B003 3
JUMP *DONE IF B004<1
JUMP *DONE IF B004>6
SET B003 1
MOVJ P007 VJ=20.00 PL=0
JUMP *DONE IF B004=1
MOVJ P008 VJ=20.00 PL=0
JUMP *DONE IF B004=2
MOVJ P009 VJ=20.00 PL=0
JUMP *DONE IF B004=3
MOVJ P010 VJ=20.00 PL=0
JUMP *DONE IF B004=4
MOVJ P011 VJ=20.00 PL=0
JUMP *DONE IF B004=5
MOVJ P012 VJ=20.00 PL=0
*DONE
SET B000 0
SET I002 I000
SET B001 2
JUMP *WAIT
*STALE
SET B000 0
JUMP *WAIT
END
)";

// Where a zone is another arm's, or nobody's, the job does not go into it: the token is the controller's word.
constexpr const char* kTaken = "SET I001 I000\nSET B001 1\n";
constexpr const char* kWaist = R"(*WAIST
JUMP *STALE IF I000=I002
SET I001 I000
SET B001 1
'BOTH ARMS WAIT; TWAIST TURNS THE
'WAIST TO I004 AND ANSWERS IN I005
SET B003 3
JUMP *DONE IF B020>0
JUMP *DONE IF B021>0
CALL JOB:TWAIST
JUMP *DONE IF I005<>I004
SET B003 1
JUMP *DONE
)";

void insert_after(std::string& text, const std::string& label, const std::string& what, const std::string& added) {
  const std::size_t at = text.find(what, text.find(label)) + what.size();
  text.insert(at, added);
}

std::string shifted(const std::string& text, const std::regex& names, int by) {
  std::string out;
  auto rest = text.cbegin();
  for (std::sregex_iterator at(text.begin(), text.end(), names), end; at != end; ++at) {
    out.append(rest, (*at)[0].first);
    std::string number = std::to_string(std::stoi((*at)[2]) + by);
    out += (*at)[1].str() + std::string((*at)[2].length() - number.size(), '0') + number;
    rest = (*at)[0].second;
  }
  return out.append(rest, text.cend());
}

}  // namespace

std::string handshake_job() { return kJob; }

std::string handshake_job_of_arm(int arm) {
  std::string text = kJob;
  const std::string me = std::to_string(arm);
  for (const auto& [label, zone] :
       {std::pair{"*PICK\n", "B020"}, std::pair{"*PLACE\n", "B021"}, std::pair{"*BACK\n", "B020"}})
    insert_after(text, label, kTaken, "SET B003 3\nJUMP *DONE IF " + std::string(zone) + "<>" + me + "\n");
  insert_after(text, "'I000", "DONE\n", "'B020 WHO HAS THE BIN, B021 THE RACK\n");
  if (arm == 1) {
    insert_after(text, "JUMP *WAY", "B000=4\n", "JUMP *WAIST IF B000=5\n");
    text.insert(text.find("*WAY\n"), kWaist);
  } else {
    text = shifted(text, std::regex("([BI])(00\\d)"), 10);
    text = shifted(text, std::regex("(P)(0\\d\\d)"), 20);
    text = std::regex_replace(text, std::regex("#\\(1\\)"), "#(2)");
    text = std::regex_replace(text, std::regex("RB1"), "RB2");
  }
  text = std::regex_replace(text, std::regex("NAME BPICK"), "NAME BPICK" + me);
  return std::regex_replace(text, std::regex("VISION PICK"), "VISION PICK ARM " + me);
}

std::string waist_job() {
  return "/JOB\n//NAME TWAIST\n//INST\n///DATE 2026/01/31 12:00\n///ATTR SC,RW\n///GROUP1 RB1\nNOP\nTIMER T=2.00\n"
         "SET I005 I004\nEND\n";
}

}  // namespace tribin::controller_sim
