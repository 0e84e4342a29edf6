// endowire for C++: handles that free themselves, and errors that are thrown. To copy into your program and to extend: every
// function of endowire.h takes what get() returns.
#pragma once

#include <endowire.h>

#include <array>
#include <cstdint>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

namespace endowire {

/// A call that did not end with ENDOWIRE_STATUS_OK.
struct Error : std::runtime_error {
    EndowireStatus status;
    explicit Error(EndowireStatus status) : std::runtime_error(endowire_last_error()), status(status) {}
};

inline void check(EndowireStatus status) {
    if (status != ENDOWIRE_STATUS_OK) throw Error(status);
}

/// A list, by asking for its length first; `width` numbers make one element.
template <class T, class Ask>
std::vector<T> list(Ask ask, std::size_t width = 1) {
    std::size_t count = 0;
    check(ask(static_cast<T *>(nullptr), std::size_t{0}, &count));
    std::vector<T> values(width * count);
    check(ask(values.data(), count, &count));
    return values;
}

/// An owned handle.
template <class T, void (*Free)(T *)>
struct Handle {
    T *get() const { return handle.get(); }

protected:
    struct Freed {
        void operator()(T *owned) const { Free(owned); }
    };
    template <class Make>
    explicit Handle(Make make) {
        T *made = nullptr;
        check(make(&made));
        handle.reset(made);
    }
    std::unique_ptr<T, Freed> handle;
};

struct Scene : Handle<EndowireScene, endowire_scene_free> {
    explicit Scene(const std::string &path)
        : Handle([&](auto out) { return endowire_scene_read(path.c_str(), out); }) {}
};

struct Simulation : Handle<EndowireSimulation, endowire_simulation_free> {
    explicit Simulation(const Scene &scene)
        : Handle([&](auto out) { return endowire_simulation_new(scene.get(), out); }) {}
    Simulation(const Simulation &other)
        : Handle([&](auto out) { return endowire_simulation_clone(other.get(), out); }) {}

    EndowireReport step(const std::vector<EndowireMove> &moves) {
        check(endowire_step(get(), moves.data(), moves.size()));
        return report();
    }
    EndowireReport report() const {
        EndowireReport told{};
        told.size = sizeof told;
        check(endowire_report(get(), &told));
        return told;
    }
    /// x, y, z of each point, mm.
    std::vector<double> positions_mm() const {
        return list<double>([&](auto... room) { return endowire_positions_mm(get(), room...); }, 3);
    }
    std::vector<std::uint8_t> state() const {
        return list<std::uint8_t>([&](auto... room) { return endowire_state_save(get(), room...); });
    }
    void restore(const std::vector<std::uint8_t> &state) {
        check(endowire_state_restore(get(), state.data(), state.size()));
    }
};

struct Fluoroscopy : Handle<EndowireRenderer, endowire_renderer_free> {
    Fluoroscopy(const Simulation &simulation, std::uint32_t width_px, std::uint32_t height_px)
        : Handle([&](auto out) { return endowire_fluoroscopy_new(simulation.get(), width_px, height_px, out); }) {}

    /// Grey values, row by row from the top left.
    std::vector<std::uint8_t> picture(const Simulation &simulation) {
        return list<std::uint8_t>([&](auto... room) { return endowire_picture(get(), simulation.get(), room...); });
    }
};

}  // namespace endowire
