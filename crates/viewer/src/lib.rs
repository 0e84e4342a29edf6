//! Scene in, frames out: a 3D view and a simulated fluoroscopic view, without a window.
