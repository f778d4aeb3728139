// How near bases come to five skies: the tables of docs/bases.md, "Bases by skies".
//
//     basis_table [DIRECTIONS=200000] [NORMALS=2000]
//     basis_table response FILE.exr      DiceResponse, for docs/shaders/kiln_bases.glsl
//
// Ends with status 1 where AD9 does not come nearer to Lambert and to GGX of alpha 0.4 than SG9, as it does
// in Roughton 2019, Appendix C; other orders are printed, not judged.
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string_view>

#include "common/responses/lobes_specular.h"
#include "coordinator/scene/imageio/exr.h"
#include "tests/bench/basis_skies.h"

namespace kiln {
namespace {

void cell(double x) {
  if (std::isnan(x))
    std::printf(" |");
  else
    std::printf(" %.*f |", x < 0.1 ? 4 : x < 1 ? 3 : 2, x);
}

using Table = std::vector<std::vector<test::SkyErrors>>;  // by sky

void print_rows(const Table& table, const char* quantity, double test::SkyErrors::*column) {
  for (size_t b = 0; b < table[0].size(); ++b) {
    if (std::isnan(table[0][b].*column)) continue;
    std::printf("| %s | %s | %zu |", quantity, table[0][b].basis.c_str(), table[0][b].numbers);
    for (const auto& sky : table) cell(sky[b].*column);
    std::printf("\n");
  }
}

void heading(const char* columns, int count) {
  std::printf("| %s |", columns);
  for (const test::Sky& sky : test::skies()) std::printf(" %s |", sky.name);
  std::printf("\n|");
  for (int i = 0; i < count + static_cast<int>(test::skies().size()); ++i) std::printf("---|");
  std::printf("\n");
}

int run(int directions, int normals) {
  Table table;
  for (const test::Sky& sky : test::skies()) table.push_back(test::sky_errors(sky, directions, normals));
  heading("quantity | basis | numbers", 3);
  print_rows(table, "radiance", &test::SkyErrors::radiance);
  print_rows(table, "Lambert", &test::SkyErrors::lambert);
  print_rows(table, "GGX 0.4", &test::SkyErrors::rough);
  print_rows(table, "GGX 0.1", &test::SkyErrors::smooth);
  std::printf("\n");
  std::vector<std::vector<test::ReflectionErrors>> reflections;
  for (const test::Sky& sky : test::skies())
    reflections.push_back(test::reflection_errors(sky, directions, normals / 4));
  heading("GGX | basis", 2);
  for (const bool rough : {true, false})
    for (size_t b = 0; b < reflections[0].size(); ++b) {
      std::printf("| %s | %s |", rough ? "0.4" : "0.1", reflections[0][b].basis.c_str());
      for (const auto& sky : reflections) cell(rough ? sky[b].rough : sky[b].smooth);
      std::printf("\n");
    }
  bool kept = true;
  for (size_t k = 0; k < table.size(); ++k) kept &= test::keeps_order(test::skies()[k], table[k]);
  if (!kept) std::fputs("an order is lost\n", stderr);
  return kept ? 0 : 1;
}

int write_response(const char* file) {
  std::vector<float> f0, f90;
  for (const DiceResponse::Scale& scale : DiceResponse::get().entries())
    f0.push_back(scale.f0), f90.push_back(scale.f90);
  const ExrChannel channels[] = {{"R", f0.data()}, {"G", f90.data()}};
  const Status written =
      write_exr(file, DiceResponse::kSize, DiceResponse::kSize, channels, {ExrType::kHalf});
  if (!written) std::fprintf(stderr, "%s\n", written.error().message.c_str());
  return written ? 0 : 1;
}

}  // namespace
}  // namespace kiln

int main(int argc, char** argv) {
  if (argc == 3 && std::string_view(argv[1]) == "response") return kiln::write_response(argv[2]);
  const int directions = argc > 1 ? std::atoi(argv[1]) : 200000,
            normals = argc > 2 ? std::atoi(argv[2]) : 2000;
  if (directions < 1000 || normals < 100) {
    std::fputs("usage: basis_table [DIRECTIONS] [NORMALS] | response FILE.exr\n", stderr);
    return 2;
  }
  return kiln::run(directions, normals);
}
