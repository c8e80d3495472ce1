/* Presses a cube with a tip and prints its force: press SCENE STEPS PRINT_EVERY.
 *
 * The scene has a device "finger" without a path. */

#define _DEFAULT_SOURCE /* getrusage */

#include <palpate.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/resource.h>

static void stop(const char *what, const PalpateError *error) {
  fprintf(stderr, "%s: %s\n", what, error->message);
  exit(1);
}

int main(int argc, char **argv) {
  if (argc != 4) {
    fprintf(stderr, "usage: press SCENE STEPS PRINT_EVERY\n");
    return 2;
  }
  if (palpate_abi_version() != PALPATE_ABI_VERSION) {
    fprintf(stderr, "the library is of another version than palpate.h\n");
    return 2;
  }
  PalpateError error;
  PalpateScene *scene;
  if (palpate_scene_load(argv[1], PALPATE_PURPOSE_REAL_TIME, &scene, &error) != PALPATE_STATUS_OK) stop("the scene", &error);
  for (size_t i = 0; palpate_scene_warning(scene, i) != NULL; i++) fprintf(stderr, "warning: %s\n", palpate_scene_warning(scene, i));
  PalpateState *state;
  if (palpate_state_new(scene, &state, &error) != PALPATE_STATUS_OK) stop("the state", &error);
  ptrdiff_t finger = palpate_scene_find(scene, PALPATE_PART_DEVICE, "finger");
  if (finger < 0) {
    fprintf(stderr, "the scene has no device \"finger\"\n");
    return 1;
  }

  const double step = palpate_scene_step_s(scene);
  const long steps = atol(argv[2]), every = atol(argv[3]);
  for (long i = 1; i <= steps; i++) {
    /* From 10 mm above the cube down to 4 mm inside in 0.1 s, back, and again. */
    double t = (double)(i % 200) * step;
    double depth = 0.14 * (t < 0.1 ? t : 0.2 - t);
    PalpateVector position = {0.0, 0.0, 0.115 - depth};
    palpate_state_set_position(state, (size_t)finger, position);
    palpate_state_step(state);
    if (i % every == 0) {
      size_t contacts;
      palpate_state_contacts(state, &contacts);
      const PalpateVector force = palpate_state_devices(state, NULL)[finger].force_on_hand;
      printf("%ld %.17g %.17g %.17g %zu\n", i, force.x, force.y, force.z, contacts);
    }
  }
  for (size_t i = 0; palpate_state_warning(state, i) != NULL; i++) fprintf(stderr, "warning: %s\n", palpate_state_warning(state, i));
  const PalpateStepStatus *status = palpate_state_status(state);
  if (status->rejected_inputs != 0 || status->dropped_contacts != 0) return 1;
  palpate_state_free(state);
  palpate_scene_free(scene);
  struct rusage used;
  if (getrusage(RUSAGE_SELF, &used) == 0) fprintf(stderr, "memory: %ld kB\n", used.ru_maxrss);
  return 0;
}
