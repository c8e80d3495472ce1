/* Uses the interface wrongly: misuse SCENE. Prints what it answers. */

#include <math.h>
#include <palpate.h>
#include <stdio.h>
#include <string.h>

static PalpateError error;

/* Status and message of a call, which begins with what failed last. */
static void show(const char *call, PalpateStatus status) {
  printf("%s: %d %s\n", call, (int)status, status == PALPATE_STATUS_OK ? "" : error.message);
  memset(&error, 0, sizeof error);
}

int main(int argc, char **argv) {
  if (argc != 2) return 2;
  PalpateScene *scene = NULL;
  PalpateState *state = NULL, *copy = NULL;
  show("no path", palpate_scene_load(NULL, PALPATE_PURPOSE_OFFLINE, &scene, &error));
  show("no file", palpate_scene_load("missing.toml", PALPATE_PURPOSE_OFFLINE, &scene, &error));
  show("a folder", palpate_scene_load(".", PALPATE_PURPOSE_OFFLINE, &scene, &error));
  show("bytes", palpate_scene_load("\xff", PALPATE_PURPOSE_OFFLINE, &scene, &error));
  show("no result", palpate_scene_load(argv[1], PALPATE_PURPOSE_OFFLINE, NULL, &error));
  show("purpose 9", palpate_scene_load(argv[1], 9, &scene, &error));
  show("no error", palpate_scene_load("missing.toml", PALPATE_PURPOSE_OFFLINE, &scene, NULL));
  show("no scene", palpate_state_new(NULL, &state, &error));
  printf("nulls: %g %zu %d %d %zu\n", palpate_scene_step_s(NULL), palpate_scene_count(NULL, PALPATE_PART_OBJECT),
         palpate_scene_name(NULL, PALPATE_PART_OBJECT, 0) == NULL, palpate_state_energy(NULL) == NULL,
         palpate_scene_node_count(NULL, 0));
  palpate_scene_free(NULL);
  palpate_state_free(NULL);

  show("load", palpate_scene_load(argv[1], PALPATE_PURPOSE_OFFLINE, &scene, &error));
  show("new", palpate_state_new(scene, &state, &error));
  printf("names: %s %s %s %d %td\n", palpate_scene_name(scene, PALPATE_PART_OBJECT, 0),
         palpate_scene_name(scene, PALPATE_PART_DEVICE, 0), palpate_scene_name(scene, PALPATE_PART_OBSTACLE, 0),
         palpate_scene_name(scene, PALPATE_PART_CLAMP, 0) == NULL, palpate_scene_find(scene, PALPATE_PART_DEVICE, "foot"));
  printf("parts of kind 7: %zu\n", palpate_scene_count(scene, 7));
  /* The state keeps its scene alive. */
  palpate_scene_free(scene);

  PalpateVector nowhere = {NAN, 0.0, 0.0}, above = {0.0, 0.0, 0.2};
  PalpateDeviceInput input;
  show("input", palpate_state_device_input(state, 0, &input));
  printf("begins in mode %u\n", (unsigned)input.mode);
  show("force", palpate_state_set_force(state, 0, above));
  /* A refused call does not let a device begin, which would touch at the origin, inside the cube. */
  palpate_state_step(state);
  size_t contacts = 0;
  const PalpateContactOutput *contact = palpate_state_contacts(state, &contacts);
  for (size_t i = 0; i < contacts; i++) printf("%s", contact[i].against == PALPATE_COLLIDER_DEVICE ? "the finger touches\n" : "");
  show("device 5", palpate_state_set_position(state, 5, above));
  input.mode = 77;
  show("mode 77", palpate_state_set_device(state, 0, &input, &error));
  input.mode = PALPATE_DEVICE_MODE_HELD;
  input.point.object = 3;
  show("object 3", palpate_state_set_device(state, 0, &input, &error));
  input.point.object = 0;
  input.point.triangle = 1000000;
  show("triangle 1000000", palpate_state_set_device(state, 0, &input, &error));
  show("obstacle 9", palpate_state_set_obstacle(state, 9, palpate_state_objects(state, NULL)->pose));
  show("nan", palpate_state_set_position(state, 0, nowhere));
  show("step", palpate_state_step(state));
  printf("rejected: %u\n", (unsigned)palpate_state_status(state)->rejected_inputs);
  /* A hand in millimetres is told of once. */
  PalpateVector millimetres = {0.0, 0.0, 200.0};
  show("copy", palpate_state_copy(state, &copy, &error));
  palpate_state_set_position(copy, 0, millimetres);
  for (int i = 0; i < 3; i++) palpate_state_step(copy);
  for (size_t i = 0; palpate_state_warning(copy, i) != NULL; i++) printf("warning: %s\n", palpate_state_warning(copy, i));
  printf("warnings before: %d, of no state: %d\n", palpate_state_warning(state, 0) != NULL, palpate_state_warning(NULL, 0) != NULL);
  palpate_state_free(copy);
  show("no state", palpate_state_step(NULL));
  double number;
  show("surface", palpate_state_surface(state, 0, &number, 1));
  show("surface of 4", palpate_state_surface(state, 4, &number, 1));

  show("nowhere", palpate_state_nearest_point(state, 0, nowhere, &input.point));
  show("nearest", palpate_state_nearest_point(state, 0, above, &input.point));
  input.mode = PALPATE_DEVICE_MODE_HELD;
  show("position", palpate_state_point_position(state, input.point, &input.position));
  input.position.z += 0.001;
  show("held", palpate_state_set_device(state, 0, &input, &error));
  show("copy", palpate_state_copy(state, &copy, &error));
  for (int i = 0; i < 20; i++) {
    palpate_state_step(state);
    palpate_state_step(copy);
  }
  PalpateVector a = palpate_state_devices(state, NULL)->force_on_hand, b = palpate_state_devices(copy, NULL)->force_on_hand;
  printf("pulled: %d, alike: %d, time: %g\n", a.z < -0.001, memcmp(&a, &b, sizeof a) == 0, palpate_state_time_s(copy));
  size_t obstacles;
  const PalpateObstacleOutput *floor = palpate_state_obstacles(state, &obstacles);
  contact = palpate_state_contacts(state, &contacts);
  double carried = 0.0;
  for (size_t i = 0; i < contacts; i++)
    if (contact[i].against == PALPATE_COLLIDER_OBSTACLE) carried -= contact[i].force.z;
  printf("obstacles: %d, pressed: %d, by its contacts: %d\n", (int)obstacles, floor->force.z < 0.0, floor->force.z == carried);
  palpate_state_free(state);
  palpate_state_free(copy);
  return 0;
}
