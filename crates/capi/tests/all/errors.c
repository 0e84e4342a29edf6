/* What is wrong, from C: one line for each case, its name and the status. And how large structures are here. */
#include <endowire.h>
#include <stdio.h>
#include <string.h>

#define TOLD(name, call) printf("%s %d\n", name, (int)(call))

int main(int argc, char **argv)
{
    EndowireScene *scene = NULL;
    EndowireSimulation *simulation = NULL;
    EndowireRenderer *renderer = NULL;
    EndowireMove move = {0, 2.0, 0.0, 0.0};
    EndowireReport report;
    EndowireInstrument instrument = {.size = sizeof instrument};
    double positions_mm[3];
    unsigned char pixels[4];
    size_t count = 0;

    printf("sizes %zu %zu %zu %zu\n", sizeof(EndowireMove), sizeof(EndowireReport), sizeof(EndowireInstrument),
           sizeof(EndowireContact));
    if (argc != 2 || strlen(endowire_version()) < 5) {
        return 1;
    }
    TOLD("missing", endowire_scene_read("nowhere.toml", &scene));
    printf("text %s\n", endowire_last_error());
    TOLD("no_path", endowire_scene_read(NULL, &scene));
    TOLD("no_out", endowire_scene_read(argv[1], NULL));
    TOLD("not_utf8", endowire_scene_read("\xff\xfe", &scene));
    TOLD("wrong_key", endowire_scene_from_text("[vessel]\nfil = 1\n", NULL, &scene));
    TOLD("no_scene", endowire_simulation_new(NULL, &simulation));
    TOLD("read", endowire_scene_read(argv[1], &scene));
    TOLD("made", endowire_simulation_new(scene, &simulation));

    TOLD("no_simulation", endowire_step(NULL, &move, 1));
    TOLD("no_moves", endowire_step(simulation, NULL, 1));
    TOLD("no_motion", endowire_step(simulation, NULL, 0));
    move.instrument = UINT64_MAX;
    TOLD("no_such_instrument", endowire_step(simulation, &move, 1));
    move.instrument = 0;
    move.advance_mm = 1e9;
    TOLD("too_far", endowire_step(simulation, &move, 1));
    move.advance_mm = 2.0;
    TOLD("no_solves", endowire_tick(simulation, &move, 1, 0));
    TOLD("back_in_time", endowire_step_until(simulation, &move, 1, -1.0));
    TOLD("no_coil", endowire_detach(simulation, 0));
    TOLD("step", endowire_step(simulation, &move, 1));

    report.size = 8;
    TOLD("small_report", endowire_report(simulation, &report));
    report.size = sizeof report;
    TOLD("no_report", endowire_report(simulation, NULL));
    TOLD("report", endowire_report(simulation, &report));
    TOLD("instrument", endowire_instrument(simulation, 0, &instrument));
    TOLD("no_instrument", endowire_instrument(simulation, 1, &instrument));
    TOLD("few_points", endowire_positions_mm(simulation, positions_mm, 1, &count));
    printf("points %d %u\n", (int)count, report.points);
    TOLD("no_points", endowire_positions_mm(simulation, NULL, 1, &count));
    TOLD("no_count", endowire_positions_mm(simulation, positions_mm, 1, NULL));
    TOLD("no_such_coil", endowire_coil_positions_mm(simulation, 0, NULL, 0, &count));
    TOLD("not_a_state", endowire_state_restore(simulation, pixels, 0));
    TOLD("no_size", endowire_fluoroscopy_new(simulation, 0, 64, &renderer));
    TOLD("renderer", endowire_view_3d_new(simulation, 64, 64, &renderer));
    TOLD("few_pixels", endowire_picture(renderer, simulation, pixels, sizeof pixels, &count));
    TOLD("no_renderer", endowire_picture(NULL, simulation, pixels, sizeof pixels, &count));
    TOLD("no_c_arm", endowire_turn_c_arm(renderer, 30.0, 0.0));
    TOLD("no_lumen", endowire_inject(renderer, simulation, 5.0, 5.0));

    endowire_renderer_free(renderer);
    endowire_renderer_free(NULL);
    endowire_simulation_free(simulation);
    endowire_simulation_free(NULL);
    endowire_scene_free(scene);
    endowire_scene_free(NULL);
    return 0;
}
