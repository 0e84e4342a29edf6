/*
 * Pushes a wire 60 mm towards the aortic arch, turns it, and prints its tip.
 *
 *   cc examples/insert.c $(pkg-config --cflags --libs endowire) -o insert
 *   ./insert assets/scenes/arch_carotid.toml
 */
#include <endowire.h>
#include <stdio.h>
#include <stdlib.h>

static int failed(const char *what)
{
    fprintf(stderr, "%s: %s\n", what, endowire_last_error());
    return EXIT_FAILURE;
}

/* Thirty steps of 2 mm and 0.1 rad. */
static int insert(EndowireSimulation *simulation)
{
    EndowireMove move = {.instrument = 0, .advance_mm = 2.0, .rotate_rad = 0.1};
    EndowireReport report = {.size = sizeof report};
    for (int step = 0; step < 30; step++) {
        if (endowire_step(simulation, &move, 1) != ENDOWIRE_STATUS_OK) {
            return failed("step");
        }
    }
    if (endowire_report(simulation, &report) != ENDOWIRE_STATUS_OK) {
        return failed("report");
    }
    /* 17 digits are all that a double has: they read back to the same bits. */
    printf("inserted_mm %.17g\n", report.inserted_mm);
    printf("push_force_n %.17g\n", report.push_force_n);
    printf("tip_mm %.17g %.17g %.17g\n", report.tip_mm[0], report.tip_mm[1], report.tip_mm[2]);

    /* The centre line: ask how many points there are, make room, ask again. */
    size_t count = 0;
    endowire_positions_mm(simulation, NULL, 0, &count);
    double *positions_mm = malloc(3 * count * sizeof *positions_mm);
    if (positions_mm == NULL) {
        return EXIT_FAILURE;
    }
    int status = EXIT_SUCCESS;
    if (endowire_positions_mm(simulation, positions_mm, count, &count) == ENDOWIRE_STATUS_OK) {
        printf("points %zu, the first at %.3f %.3f %.3f\n", count, positions_mm[0], positions_mm[1], positions_mm[2]);
    } else {
        status = failed("positions");
    }
    free(positions_mm);
    return status;
}

int main(int argc, char **argv)
{
    const char *path = argc > 1 ? argv[1] : "assets/scenes/arch_carotid.toml";
    EndowireScene *scene = NULL;
    EndowireSimulation *simulation = NULL;

    if (endowire_abi_version() != ENDOWIRE_ABI_VERSION) {
        fprintf(stderr, "this library, %s, is not that of the header\n", endowire_version());
        return EXIT_FAILURE;
    }
    if (endowire_scene_read(path, &scene) != ENDOWIRE_STATUS_OK) {
        return failed("scene");
    }
    int status = endowire_simulation_new(scene, &simulation) == ENDOWIRE_STATUS_OK ? insert(simulation)
                                                                                   : failed("simulation");
    endowire_simulation_free(simulation);
    endowire_scene_free(scene);
    return status;
}
