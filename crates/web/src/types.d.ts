/** A picture: red, green, blue and alpha of each pixel, row by row from the top left. */
export interface Picture { width: number; height: number; data: Uint8ClampedArray; }

/** An input of the operator. Without a name, it applies to the selected instrument. */
export type Input =
  | { do: "select"; instrument: string }
  | { do: "move"; instrument?: string; mm_per_s?: number; deg_per_s?: number }
  | { do: "nudge"; instrument?: string; mm?: number; deg?: number }
  | { do: "steer"; instrument?: string; to?: number; per_s?: number }
  | { do: "stop" } | { do: "script" } | { do: "detach"; instrument?: string } | { do: "undo" } | { do: "redo" }
  | { do: "pedal"; down: boolean; mode?: "fluoro" | "cine" | "dsa" | "roadmap" }
  | { do: "inject"; ml: number; ml_per_s: number }
  | { do: "c_arm"; pose: string }
  | { do: "turn_c_arm"; lao_deg?: number; cra_deg?: number }
  | { do: "table"; right_mm?: number; down_mm?: number; second?: boolean }
  | { do: "zoom"; factor: number }
  | { do: "collimate"; width: number; height: number }
  | { do: "turn_camera"; azimuth_deg?: number; elevation_deg?: number }
  | { do: "zoom_camera"; factor: number } | { do: "move_camera"; right?: number; up?: number }
  | { do: "go_to"; step: number };

/** The readout for the operator. */
export interface Readout {
  step: number; time_s: number; demonstrates: boolean; selected: string;
  unconverged_steps: number; jumps: number; relaxations: number;
  instruments: {
    name: string; length_mm: number; inserted_mm: number; behind_mm: number; rotation_deg: number; steer?: number;
    push_force_n: number | null; torque_nmm: number; warns: boolean;
  }[];
  tip_mm: [number, number, number] | null; contacts: number; wall_force_n: number;
  lab: {
    live: boolean; mode: string; lao_deg: number; cra_deg: number; second_deg: [number, number] | null;
    magnification: number; field_mm: number; open: [number, number]; beam_s: number; dose_ugy: number;
  };
  /** Packing of the scene's sac with coils. */
  packing?: {
    coils_mm3: number; density: number; neck_coverage: number; outside_mm: number; herniated: boolean; dome_force_n: number;
  };
  subject?: {
    subject: string; distance_mm: number | null; injected_there_ml: number; packing_density?: number;
    /** How far it is to the goal, in words, one line per quantity. */
    to_go: string[];
    used: { what: string; value: number; limit: number; unit: string }[]; verdict: Verdict | null;
  };
  event: { step: number; time_s: number; kind: string; text: string } | null; events: number;
  /** Keys that would do nothing now, by their `code`, and why. */
  idle_keys: { code: string; shift: boolean; why: string }[];
}

/** The task of a training subject in words, and the thresholds of its measures. */
export interface Task {
  name: string; level: number; exam: boolean; text: string;
  goal: string; limits: string[]; counts: { name: string; title: string; definition: string; asked: string; points: number }[];
}

/** The result of a training subject; `ended` is null if it was left before its end. */
export interface Verdict { passed: boolean; score: number; band: "passed" | "missed" | "reckless" | "blind" | "not_reached"; ended: { by: "goal" | "time" | "beam" | "contrast" | "wall_force"; time_s: number } | null; }

/** The score of a training subject: numbers as in `endowire assess --json` in `metrics`, and text in `words` and `rows`. */
export interface Score extends Verdict {
  schema: number; exam: boolean; subject: string; words: string; unjudged?: { what: string; why: string }[];
  metrics: {
    name: string; title: string; group: string; value: number | null; unit: string; better: "lower" | "higher"; definition: string; study: string;
    threshold: { at_most?: number; at_least?: number; good?: number; points: number; grave?: boolean; source?: string } | null;
    passed: boolean | null; credit: number | null; unjudged?: string;
  }[];
  rows: { name: string; title: string; definition: string; value: string; asked: string | null; points: number | null; passed: boolean | null; kept: string | null }[];
}

/** The record of instruments, beam and injector: one sample per tick or step of a script; consecutive rests are one sample. */
export interface SessionRecord {
  samples: {
    time_s: number; tip_mm: [number, number, number] | null; wall_force_n: number; tip_force_n: number; jumped: boolean;
    hands: { advance_mm: number; rotate_rad: number; inserted_mm: number; push_force_n: number | null; torque_nmm: number; tip_mm?: [number, number, number] }[];
    packing?: { density: number; outside_mm: number }; undone?: boolean; out_of_picture?: boolean;
  }[];
  instruments?: string[];
  injections: {
    time_s: number; volume_ml: number; rate_ml_per_s: number;
    outlet?: { instrument?: string; at_mm: [number, number, number]; tip_force_n?: number };
  }[];
  beam: { time_s: number; on: boolean; frames_per_s: number; dose_ngy: number; field_mm2: number; primary_deg: number; secondary_deg: number }[];
}

/** Properties of a surface: hints in words, and its openings with their positions in the picture, pixels. */
export interface SurfaceReport {
  triangles: number; size_mm: [number, number, number]; notes: string[]; hints: string[]; inlet: number | null;
  openings: { index: number; radius_mm: number; centre_mm: [number, number, number]; pixel: [number, number] | null }[];
}
