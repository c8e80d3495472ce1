// Drops a cube onto a floor and writes its surface as OBJ, as a program that draws would: surface SCENE STEPS.

#include <palpate.h>

#include <cstdio>
#include <cstdlib>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

struct FreeScene {
  void operator()(PalpateScene *scene) const { palpate_scene_free(scene); }
};
struct FreeState {
  void operator()(PalpateState *state) const { palpate_state_free(state); }
};

static std::unique_ptr<PalpateScene, FreeScene> load(const std::string &path) {
  PalpateScene *scene = nullptr;
  PalpateError error;
  if (palpate_scene_load(path.c_str(), PALPATE_PURPOSE_OFFLINE, &scene, &error) != PALPATE_STATUS_OK)
    throw std::runtime_error(error.message);
  return std::unique_ptr<PalpateScene, FreeScene>(scene);
}

int main(int argc, char **argv) try {
  if (argc != 3) return 2;
  const auto scene = load(argv[1]);
  PalpateState *made = nullptr;
  if (palpate_state_new(scene.get(), &made, nullptr) != PALPATE_STATUS_OK) return 1;
  const std::unique_ptr<PalpateState, FreeState> state(made);
  for (long i = std::atol(argv[2]); i > 0; i--) palpate_state_step(state.get());

  std::vector<double> positions(3 * palpate_scene_node_count(scene.get(), 0));
  if (palpate_state_surface(state.get(), 0, positions.data(), positions.size()) != PALPATE_STATUS_OK) return 1;
  for (std::size_t i = 0; i < positions.size(); i += 3)
    std::printf("v %.17g %.17g %.17g\n", positions[i], positions[i + 1], positions[i + 2]);
  std::size_t count = 0;
  const std::uint32_t *triangles = palpate_scene_triangles(scene.get(), 0, &count);
  for (std::size_t i = 0; i < 3 * count; i += 3)
    std::printf("f %u %u %u\n", triangles[i] + 1, triangles[i + 1] + 1, triangles[i + 2] + 1);
  return 0;
} catch (const std::exception &failure) {
  std::fprintf(stderr, "%s\n", failure.what());
  return 1;
}
