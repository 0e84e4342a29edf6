/*
 * endowire: catheters and guidewires in blood vessels.
 *
 * Units everywhere: millimetre, newton, second, radian; names say them. Texts are UTF-8.
 *
 * ERRORS. Functions that can fail return an EndowireStatus. Unless it is ENDOWIRE_STATUS_OK, endowire_last_error()
 * has the reason, of the last failure of this thread. Nothing is thrown, and no panic leaves the library.
 *
 * HANDLES are made by functions with an `out`, which is set to NULL after an error, and freed once by the function
 * that is named after them. Functions that free take NULL. Everything else that is NULL is refused, unless a function
 * says otherwise. Handles do not depend on each other: a scene may be freed before its simulations.
 *
 * THREADS. A simulation or renderer is used by one thread at a time, and may move from one to another. A second thread
 * is refused (ENDOWIRE_STATUS_INPUT), it does not wait. Different simulations on different threads are free of each
 * other, clones too. A scene may be used by all threads. Nothing may be freed while another thread uses it. The library
 * computes on threads of its own (as many as there are cores, or RAYON_NUM_THREADS), and results do not depend on
 * how many there are.
 *
 * LISTS are copied into a buffer of yours: its address, its `capacity` in elements, and where to write the `count` that
 * there are. With NULL and capacity 0 only the count is written: ask, make room, ask again. With too little
 * room the count is written and ENDOWIRE_STATUS_BUFFER_TOO_SMALL returned.
 *
 * STRUCTURES that begin with `size` may grow at their end. Set it to sizeof before every call: the library fills what
 * there is room for, and sets it to how much that was. A size smaller than in ENDOWIRE_ABI_VERSION 1 is refused.
 */

#ifndef ENDOWIRE_H
#define ENDOWIRE_H

/* Made by cbindgen from crates/capi/src, do not edit: `cargo run -p endowire-capi --example header`. */

#include <stddef.h>
#include <stdint.h>

/**
 * Version of this header. It grows when a function or a layout changes in a way that a compiled program would notice;
 * new functions, and new fields at the end of structures with a size, do not change it.
 */
#define ENDOWIRE_ABI_VERSION 1

/**
 * How a call ended. Unless it is `OK`, nothing has changed but what a function says of itself, and `endowire_last_error`
 * has the reason.
 */
typedef enum {
    /**
     * It is done.
     */
    ENDOWIRE_STATUS_OK = 0,
    /**
     * The input is at fault: a file, a key, a value out of range, a handle that another thread uses. The text names it and
     * the remedy.
     */
    ENDOWIRE_STATUS_INPUT = 1,
    /**
     * The input is valid, and no result was found.
     */
    ENDOWIRE_STATUS_COMPUTATION = 2,
    /**
     * The device can go no farther: the vessel is too narrow, or the tip has left it. Not a failure.
     */
    ENDOWIRE_STATUS_END = 3,
    /**
     * An argument is NULL that may not be.
     */
    ENDOWIRE_STATUS_NULL_ARGUMENT = 4,
    /**
     * A buffer has too little room for the result, or the `size` of a structure is too small.
     */
    ENDOWIRE_STATUS_BUFFER_TOO_SMALL = 5,
    /**
     * A fault of the library (a caught panic). What it happened in refuses all further calls: free it.
     */
    ENDOWIRE_STATUS_INTERNAL = 6,
} EndowireStatus;

/**
 * Draws simulations of one scene. Its pictures follow each other, as those of a C-arm. One thread at a time may use it.
 */
typedef struct EndowireRenderer EndowireRenderer;

/**
 * A scene file: vessel, instruments, method, views. It never changes: all threads may use it at the same time.
 */
typedef struct EndowireScene EndowireScene;

/**
 * An insertion: instruments in a vessel, stepped by commands. One thread at a time may use it.
 */
typedef struct EndowireSimulation EndowireSimulation;

/**
 * Motion of one instrument.
 */
typedef struct {
    /**
     * Which instrument: in the order of the scene, the innermost is 0.
     */
    uint64_t instrument;
    /**
     * Length pushed in, mm; negative pulls back.
     */
    double advance_mm;
    /**
     * Rotation of the tail about its axis, rad; positive is right-handed about the direction of insertion.
     */
    double rotate_rad;
    /**
     * Change of the value to which a steered instrument is steered, which stays within -1 and 1; 0 for others.
     */
    double steer;
} EndowireMove;

/**
 * What the last step led to. With several instruments, numbers without a name of their own are of all together.
 */
typedef struct {
    /**
     * Set it to `sizeof(EndowireReport)`; the library sets it to how many bytes it has filled.
     */
    uint64_t size;
    /**
     * Time since the start, s.
     */
    double time_s;
    /**
     * Length beyond the mouth of the sheath of the instrument that is farthest in, mm.
     */
    double inserted_mm;
    /**
     * The tip of that instrument; the mouth of the sheath while nothing is in. mm.
     */
    double tip_mm[3];
    /**
     * Sum of the forces of all hands, N; positive pushes.
     */
    double push_force_n;
    /**
     * Sum of the torques of all hands, N mm.
     */
    double torque_nmm;
    /**
     * Sum of the magnitudes of the wall's forces, N.
     */
    double wall_force_sum_n;
    /**
     * The largest of them, N.
     */
    double wall_force_largest_n;
    /**
     * Those at the tip, N.
     */
    double wall_force_tip_n;
    /**
     * Deepest penetration of the wall, mm; 0 without contact.
     */
    double max_penetration_mm;
    /**
     * Energy of bending, mJ.
     */
    double bend_energy_mj;
    /**
     * Energy of twist, mJ.
     */
    double twist_energy_mj;
    /**
     * Energy of the deformed wall, mJ.
     */
    double wall_energy_mj;
    /**
     * Energy in fields, mJ.
     */
    double field_energy_mj;
    /**
     * Energy in the twist of the tails outside the body, mJ.
     */
    double tail_energy_mj;
    /**
     * Energy dissipated by friction in this step, mJ.
     */
    double dissipated_mj;
    /**
     * Energy released in jumps, mJ; 0 without jumps.
     */
    double released_mj;
    /**
     * Out-of-balance force relative to the largest force in the instruments.
     */
    double imbalance;
    /**
     * Drag of the blood on all instruments, N.
     */
    double drag_n[3];
    /**
     * The opening through which the instruments have left the vessel; -1 inside.
     */
    int32_t left_through;
    /**
     * Number of instruments.
     */
    uint32_t instruments;
    /**
     * Number of points of `endowire_positions_mm`.
     */
    uint32_t points;
    /**
     * Number of contacts of `endowire_contacts`.
     */
    uint32_t contacts;
    /**
     * Number of detached coils.
     */
    uint32_t coils;
    /**
     * Newton iterations.
     */
    uint32_t iterations;
    /**
     * Linear solves in them.
     */
    uint32_t solves;
    /**
     * Parts into which the command was divided.
     */
    uint32_t substeps;
    /**
     * How often the instruments slid on while the hands kept still.
     */
    uint32_t slides;
    /**
     * Parts that did not follow a path from the last equilibrium; nearly always 0.
     */
    uint32_t relaxations;
    /**
     * 1 if the step met the convergence test of its method, otherwise 0.
     */
    uint32_t converged;
    /**
     * 1 while motion is behind, or the instruments are not at rest: the next step or tick goes on with it.
     */
    uint32_t under_way;
    /**
     * 1 if no equilibrium was found, in contrast to being under way to one.
     */
    uint32_t failed;
    /**
     * 1 if the instruments jumped to a lower minimum.
     */
    uint32_t jumped;
} EndowireReport;

/**
 * One instrument.
 */
typedef struct {
    /**
     * Set it to `sizeof(EndowireInstrument)`; the library sets it to how many bytes it has filled.
     */
    uint64_t size;
    /**
     * Its whole length, mm.
     */
    double length_mm;
    /**
     * Its largest outer radius, mm.
     */
    double max_radius_mm;
    /**
     * Length of the coil at its tip that can be detached, mm; 0 if there is none.
     */
    double coil_mm;
    /**
     * Length beyond the mouth of the sheath, mm.
     */
    double inserted_mm;
    /**
     * Its tip; the mouth of the sheath while it is not in. mm.
     */
    double tip_mm[3];
    /**
     * Rotation of its hand since the start, rad.
     */
    double rotation_rad;
    /**
     * Rotation at the mouth of the sheath, rad: the hand's, less the twist of the tail between.
     */
    double mouth_rotation_rad;
    /**
     * Rotation of its tip, relative to a frame carried along the axis without twist, rad.
     */
    double tip_rotation_rad;
    /**
     * Force of its hand, N; positive pushes. NaN where it jumps: if its tip is at that of another, or it is not in.
     */
    double push_force_n;
    /**
     * Torque of its hand, N mm.
     */
    double torque_nmm;
    /**
     * Value to which it is steered, -1 to 1.
     */
    double steer;
    /**
     * What steering takes: derivative of the energy in that value, mJ.
     */
    double steer_mj;
    /**
     * Motion of its hand that it has not followed yet, mm.
     */
    double behind_advance_mm;
    /**
     * Rotation of its hand that it has not followed yet, rad.
     */
    double behind_rotate_rad;
    /**
     * Change of its steering that it has not followed yet.
     */
    double behind_steer;
    /**
     * 1 if it can be steered, otherwise 0.
     */
    uint32_t steerable;
    /**
     * 1 once its coil is detached, otherwise 0.
     */
    uint32_t detached;
} EndowireInstrument;

/**
 * A contact with the wall. Forces are of the wall on the instruments.
 */
typedef struct {
    /**
     * Place on the axis, mm.
     */
    double position_mm[3];
    /**
     * Unit normal into the lumen.
     */
    double normal[3];
    /**
     * Normal force, N.
     */
    double force_n;
    /**
     * Friction, N.
     */
    double friction_n[3];
    /**
     * Penetration, mm.
     */
    double penetration_mm;
    /**
     * Triangle of the vessel (`endowire_vessel_triangles`).
     */
    uint64_t triangle;
} EndowireContact;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

/**
 * `ENDOWIRE_ABI_VERSION` of the library that runs: compare it with that of the header before anything else.
 */
uint32_t endowire_abi_version(void);

/**
 * The version of endowire, such as "0.1.0". It lives as long as the program.
 */
const char *endowire_version(void);

/**
 * What went wrong in the last call of this thread that did not return `ENDOWIRE_STATUS_OK`, in one line of UTF-8; empty
 * before the first. It lives until the next such call of the same thread: copy it if you keep it.
 */
const char *endowire_last_error(void);

/**
 * Reads a scene file (TOML). `path` is UTF-8, as all texts here.
 */
EndowireStatus endowire_scene_read(const char *path, EndowireScene **out);

/**
 * Reads a scene from its text. Paths in it are relative to `folder`; NULL is the current folder.
 */
EndowireStatus endowire_scene_from_text(const char *toml, const char *folder, EndowireScene **out);

/**
 * Frees a scene; its simulations stay. NULL is nothing.
 */
void endowire_scene_free(EndowireScene *scene);

/**
 * Makes the simulation of a scene, at its start: what instruments specify is inserted. Reading the vessel takes its time;
 * clones share it.
 */
EndowireStatus endowire_simulation_new(const EndowireScene *scene,
                                       EndowireSimulation **out);

/**
 * Makes a second simulation in the same state, which goes on by itself, on any thread. It shares the vessel, and takes
 * microseconds.
 */
EndowireStatus endowire_simulation_clone(const EndowireSimulation *simulation,
                                         EndowireSimulation **out);

/**
 * Frees a simulation. NULL is nothing.
 */
void endowire_simulation_free(EndowireSimulation *simulation);

/**
 * Moves instruments, all at the same time, to the next equilibrium; those without a move keep still. `moves` may be empty
 * (NULL, 0). After an error the state is unchanged, to the bit.
 *
 * A step ends after a bounded number of linear solves. What is then left of the motion is behind (`under_way` in
 * `EndowireReport`), and the next step or tick goes on with it.
 */
EndowireStatus endowire_step(EndowireSimulation *simulation,
                             const EndowireMove *moves,
                             size_t count);

/**
 * As `endowire_step`, while time proceeds to `time_s` (s since the start), and with it a vessel that moves.
 */
EndowireStatus endowire_step_until(EndowireSimulation *simulation,
                                   const EndowireMove *moves,
                                   size_t count,
                                   double time_s);

/**
 * As `endowire_step`, as a tick of bounded cost, for haptics and displays that need an answer in time: in about `solves`
 * linear solves (at least 1; 8 are enough to follow hands at 1 kHz), whether or not the instruments come to rest.
 */
EndowireStatus endowire_tick(EndowireSimulation *simulation,
                             const EndowireMove *moves,
                             size_t count,
                             size_t solves);

/**
 * As `endowire_tick`, while time proceeds to `time_s` (s since the start), and with it a vessel that moves.
 */
EndowireStatus endowire_tick_until(EndowireSimulation *simulation,
                                   const EndowireMove *moves,
                                   size_t count,
                                   size_t solves,
                                   double time_s);

/**
 * Drops the motion that ticks and steps have left behind: the hands are then where the instruments are.
 */
EndowireStatus endowire_forget(EndowireSimulation *simulation);

/**
 * Detaches the coil of an instrument, where it comes to rest, and withdraws its pusher. After an error the state is
 * unchanged.
 */
EndowireStatus endowire_detach(EndowireSimulation *simulation,
                               size_t instrument);

/**
 * Fills the report of the last step.
 */
EndowireStatus endowire_report(const EndowireSimulation *simulation, EndowireReport *report);

/**
 * Fills what is known of one instrument; the innermost is 0.
 */
EndowireStatus endowire_instrument(const EndowireSimulation *simulation,
                                   size_t instrument,
                                   EndowireInstrument *out);

/**
 * Copies the contacts with the wall: a list (see the top) with a capacity in contacts.
 */
EndowireStatus endowire_contacts(const EndowireSimulation *simulation,
                                 EndowireContact *contacts,
                                 size_t capacity,
                                 size_t *count);

/**
 * Copies the centre line that all instruments share, from the mouth of the sheath to the tip: a list (see the top) of
 * points x, y, z in mm. `capacity` and `count` are in points: `positions_mm` has room for 3 * `capacity` numbers.
 */
EndowireStatus endowire_positions_mm(const EndowireSimulation *simulation,
                                     double *positions_mm,
                                     size_t capacity,
                                     size_t *count);

/**
 * Copies the outer radius of an instrument at each point of `endowire_positions_mm`, mm; 0 where it is not. A list (see the
 * top).
 */
EndowireStatus endowire_radii_mm(const EndowireSimulation *simulation,
                                 size_t instrument,
                                 double *radii_mm,
                                 size_t capacity,
                                 size_t *count);

/**
 * Copies the line of a detached coil, from its detached end to its tip; coils are counted from 0 in the order in which they
 * were detached. A list of points, as of `endowire_positions_mm`.
 */
EndowireStatus endowire_coil_positions_mm(const EndowireSimulation *simulation,
                                          size_t coil,
                                          double *positions_mm,
                                          size_t capacity,
                                          size_t *count);

/**
 * Copies the vertices of the vessel at rest, mm: a list of points, as of `endowire_positions_mm`. They never change.
 */
EndowireStatus endowire_vessel_vertices_mm(const EndowireSimulation *simulation,
                                           double *vertices_mm,
                                           size_t capacity,
                                           size_t *count);

/**
 * Copies the vertices of the vessel where they are now, mm, as many and in the same order as those at rest: where the vessel
 * moves (`[[vessel.motion]]`) or its course yields (`[vessel.yielding]`) they change with every step.
 */
EndowireStatus endowire_vessel_vertices_now_mm(const EndowireSimulation *simulation,
                                               double *vertices_mm,
                                               size_t capacity,
                                               size_t *count);

/**
 * Copies the triangles of the vessel: a list (see the top) of three numbers of vertices each, counter-clockwise seen from
 * outside. `capacity` and `count` are in triangles: `triangles` has room for 3 * `capacity` numbers.
 */
EndowireStatus endowire_vessel_triangles(const EndowireSimulation *simulation,
                                         uint32_t *triangles,
                                         size_t capacity,
                                         size_t *count);

/**
 * Copies the state as bytes: all that the next step depends on besides the scene. A list (see the top); the number of bytes
 * changes from step to step. Programs in Python read them with `State.from_bytes`, and the other way round.
 */
EndowireStatus endowire_state_save(const EndowireSimulation *simulation,
                                   uint8_t *bytes,
                                   size_t capacity,
                                   size_t *count);

/**
 * Continues from a state of the same scene, to the bit. After an error nothing has changed.
 */
EndowireStatus endowire_state_restore(EndowireSimulation *simulation, const uint8_t *bytes, size_t count);

/**
 * Makes a renderer of the fluoroscopic view of a simulation's scene, with the keys of its `[view]` but for the size: each
 * side 1 to 4096 pixels. Pixels are one byte each, 0 is black. The first picture takes longer than the others.
 */
EndowireStatus endowire_fluoroscopy_new(const EndowireSimulation *simulation,
                                        uint32_t width_px,
                                        uint32_t height_px,
                                        EndowireRenderer **out);

/**
 * As `endowire_fluoroscopy_new`, of the 3D view. Pixels are four bytes each: red, green, blue, alpha.
 */
EndowireStatus endowire_view_3d_new(const EndowireSimulation *simulation,
                                    uint32_t width_px,
                                    uint32_t height_px,
                                    EndowireRenderer **out);

/**
 * Frees a renderer. NULL is nothing.
 */
void endowire_renderer_free(EndowireRenderer *renderer);

/**
 * Draws the next picture of a simulation: of the one that the renderer was made for, or another of the same scene. Pixels
 * are row by row from the top left; a list (see the top) with a capacity in bytes, and nothing is drawn where only the
 * length is asked for. Pictures are 1 / `view.frames_per_s` apart in time, whatever the simulation's is.
 */
EndowireStatus endowire_picture(EndowireRenderer *renderer,
                                const EndowireSimulation *simulation,
                                uint8_t *pixels,
                                size_t capacity,
                                size_t *count);

/**
 * Turns the C-arm of a fluoroscopic renderer: primary angle (LAO positive, -360 to 360 degrees) and secondary angle
 * (cranial positive, -90 to 90 degrees). The next picture is from there. After an error it stands where it stood.
 */
EndowireStatus endowire_turn_c_arm(EndowireRenderer *renderer,
                                   double primary_deg,
                                   double secondary_deg);

/**
 * Injects contrast medium (370 mg iodine per ml), from the next fluoroscopic picture on, where the tip of the innermost
 * instrument with a lumen is now. `ml` and `ml_per_s` are 0.1 to 100.
 */
EndowireStatus endowire_inject(EndowireRenderer *renderer,
                               const EndowireSimulation *simulation,
                               double ml,
                               double ml_per_s);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* ENDOWIRE_H */
