// As insert.c, in C++: and a clone that goes another way, a state that is saved, and a fluoroscopic picture.
//
//   c++ -std=c++17 examples/insert.cpp $(pkg-config --cflags --libs endowire) -o insert
//   ./insert assets/scenes/arch_carotid.toml picture.pgm
#include "endowire.hpp"

#include <cstdio>
#include <exception>
#include <fstream>
#include <string>

int main(int argc, char **argv) try {
    endowire::Simulation simulation(endowire::Scene(argc > 1 ? argv[1] : "assets/scenes/arch_carotid.toml"));
    const EndowireMove push{0, 2.0, 0.1, 0.0};
    for (int step = 0; step < 20; step++) simulation.step({push});

    // A clone goes on by itself: pulled back, it does not move the other.
    endowire::Simulation clone = simulation;
    clone.step({EndowireMove{0, -30.0, 0.0, 0.0}});
    const auto state = simulation.state();
    for (int step = 20; step < 30; step++) simulation.step({push});
    // The clone, put where the other was, arrives where the other does.
    clone.restore(state);
    for (int step = 20; step < 30; step++) clone.step({push});

    for (const endowire::Simulation *one : {&simulation, &clone}) {
        const EndowireReport report = one->report();
        std::printf("tip_mm %.17g %.17g %.17g\n", report.tip_mm[0], report.tip_mm[1], report.tip_mm[2]);
    }
    if (argc > 2) {
        const std::uint32_t side_px = 128;
        endowire::Fluoroscopy fluoroscopy(simulation, side_px, side_px);
        const auto grey = fluoroscopy.picture(simulation);
        std::ofstream file(argv[2], std::ios::binary);
        file << "P5 " << side_px << ' ' << side_px << " 255\n";
        file.write(reinterpret_cast<const char *>(grey.data()), static_cast<std::streamsize>(grey.size()));
    }
    return 0;
} catch (const std::exception &error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
}
