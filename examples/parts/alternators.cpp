#include "alternators.hpp"

#include "solids.hpp"

namespace parts {

TopoDS_Shape alternator_a() {
  // Rear cover, rear bracket, stator pack, front bracket, hub, pulley with six ribs, shaft.
  std::vector<Corner> profile = {{0, 0},     {40, 0, 4}, {40, 24},  {50, 24, 2}, {50, 46},
                                 {52.5, 46}, {52.5, 70}, {54, 70},  {54, 94, 4}, {30, 99},
                                 {18, 99},   {18, 103},  {10, 103}, {10, 106},   {28, 106}};
  for (int rib = 0; rib < 6; ++rib) {  // 3.56 mm apart, 40 deg: the PK belt of cars
    const double z = 108 + 3.56 * rib;
    profile.insert(profile.end(), {{28, z + 0.7}, {25.2, z + 1.78}, {28, z + 2.86}});
  }
  profile.insert(profile.end(), {{28, 132}, {19, 132}, {19, 127}, {7.5, 127}, {7.5, 140}, {0, 140}});
  TopoDS_Shape body = turned(profile);

  std::vector<TopoDS_Shape> more = {
      hexagon(0, 0, 22, 126, 136),  // pulley nut
      ear(90, 66, 10, 26, 74, 88),
      ear(90, 66, 10, 26, 27, 41),         // hinge, front and rear
      ear(250, 64, 9, 22, 78, 90),         // adjusting ear
      block(330, 30, 57, -11, 11, 3, 20),  // connector
      rod(-24, 10, 4, -6, 2),
      hexagon(-24, 10, 13, -2.5, 2),  // terminal stud
  };
  for (const double angle : {17, 137, 197, 317}) {  // tie bolts
    const Place p = polar(angle, 50);
    more.push_back(rod(p.x, p.y, 6, 26, 90));
    more.push_back(hexagon(p.x, p.y, 9, 20, 27));
  }
  body = fused(body, more);

  const Place hinge = polar(90, 66), adjust = polar(250, 64);
  std::vector<TopoDS_Shape> tools = {rod(hinge.x, hinge.y, 5.2, 20, 95), rod(adjust.x, adjust.y, 4.2, 70, 95),
                                     block(330, 45, 60, -8, 8, 6, 17)};
  for (int i = 0; i < 10; ++i) tools.push_back(ring_sector(36 * i + 9, 24, 23, 43, 84, 104));  // fan windows
  for (const double angle : {0, 40, 115, 160, 180, 220, 275, 340})  // between the tie bolts and off the hinge
    tools.push_back(block(angle, 44, 60, -3, 3, 30, 43));
  for (const double angle : {20, 70, 120, 200, 250, 300}) tools.push_back(block(angle, 16, 31, -2.5, 2.5, -8, 4));
  for (const double angle : {357, 37, 157, 177, 217, 287, 337}) tools.push_back(block(angle, 47, 60, -5, 5, 76, 85));
  return cut(body, tools);
}

TopoDS_Shape alternator_b() {
  // Conical rear cover with a sunk bearing, wide rear bracket, stator lying back, front bracket with collar, V pulley.
  const std::vector<Corner> profile = {
      {0, 4},     {13, 4},     {13, 0},     {33, 0, 3},   {45, 19, 3}, {45, 26},    {52, 26, 2}, {52, 48},  {48.5, 48},
      {48.5, 71}, {53, 71},    {53, 89, 3}, {31, 89},     {31, 96},    {16, 96},    {16, 102},   {10, 102}, {10, 104},
      {34, 104},  {34, 106.5}, {25, 110},   {25, 112},    {34, 115.5}, {34, 118.5}, {25, 122},   {25, 124}, {34, 127.5},
      {34, 130},  {23, 130},   {23, 124.5}, {8.5, 124.5}, {8.5, 138},  {0, 138}};
  TopoDS_Shape body = turned(profile);

  std::vector<TopoDS_Shape> more = {
      hexagon(0, 0, 24, 123, 133),        ear(90, 67, 11, 24, 73, 85),
      ear(90, 67, 11, 24, 27, 47),                                        // hinge, front and rear
      ear(222, 63, 8.5, 20, 75, 87),      ear(318, 63, 8.5, 20, 75, 87),  // adjusting ears
      block(25, 26, 48, -14, 14, -7, 14),                                 // connector, to the rear
      rod(-18, -24, 4.5, -7, 4),          hexagon(-18, -24, 15, -2, 4),   // terminal stud
  };
  for (const double angle : {48, 160, 270}) {
    const Place p = polar(angle, 48.5);
    more.push_back(rod(p.x, p.y, 6.5, 28, 86));
    more.push_back(hexagon(p.x, p.y, 10, 20, 29));
  }
  body = fused(body, more);

  const Place hinge = polar(90, 67), left = polar(222, 63), right = polar(318, 63);
  std::vector<TopoDS_Shape> tools = {rod(hinge.x, hinge.y, 6.2, 20, 95), rod(left.x, left.y, 4.2, 70, 95),
                                     rod(right.x, right.y, 4.2, 70, 95), block(25, 29, 45, -11, 11, -10, 2)};
  for (int i = 0; i < 6; ++i) tools.push_back(ring_sector(60 * i + 20, 40, 34.5, 46.5, 78, 103));
  for (const double angle : {80, 125, 197, 269, 330}) {  // around terminal and connector
    const Place p = polar(angle, 23);
    tools.push_back(rod(p.x, p.y, angle == 80 || angle == 330 ? 3 : 5, -10, 6));
  }
  for (const double angle : {0, 20, 125, 185, 210, 237, 300, 330})
    tools.push_back(block(angle, 45, 60, -4.5, 4.5, 30, 45));
  return cut(body, tools);
}

TopoDS_Shape battery() {
  // Case on a hold-down foot, lid with six plugs in a row, two terminals of different size and shape, a label's pocket.
  TopoDS_Shape body = block(0, -55, 55, -33, 33, 0, 78);
  std::vector<TopoDS_Shape> more = {
      block(0, -59, 59, -37, 37, 0, 10),   // foot
      block(0, -56, 56, -34, 34, 78, 90),  // lid
      block(0, -50, -32, 8, 26, 90, 103),  // terminal, square
      rod(41, 17, 8, 90, 106),             // terminal, round
  };
  for (int i = 0; i < 6; ++i) more.push_back(rod(-40 + 16 * i, -17, 6.5, 90, 94));
  body = fused(body, more);
  return cut(body, {rod(-41, 17, 3.3, 88, 110), rod(41, 17, 3.3, 98, 110), block(0, -45, 45, 31.5, 40, 25, 65),
                    block(0, 53.5, 60, -20, 20, 35, 60)});
}

}  // namespace parts
