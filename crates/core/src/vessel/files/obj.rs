//! Wavefront OBJ: `v` and `f` lines; all objects and groups make one surface.
//!
//! By hand, because the crate for it (tobj 4.0) splits a surface by object, group and material into models with vertices of
//! their own, and keeps 64-bit numbers only by a feature that would change them for every other crate in a build.

use std::fmt::Write;

use super::Reason;
use crate::vessel::SurfaceMesh;

pub(super) fn parse(bytes: &[u8]) -> Result<SurfaceMesh, Reason> {
    // Comments and names may be in any encoding; what counts is ASCII.
    let text = String::from_utf8_lossy(bytes);
    let mut mesh = SurfaceMesh::default();
    let mut polygon = Vec::new();
    for (index, line) in text.lines().enumerate() {
        let mut words = line.split('#').next().unwrap_or_default().split_whitespace();
        let what = || format!("line {}", index + 1);
        match words.next() {
            Some("v") => mesh.vertices_mm.push(super::coordinates(words, what)?),
            Some("f") => {
                polygon.clear();
                for word in words {
                    polygon.push(vertex_index(word, mesh.vertices_mm.len(), what)?);
                }
                super::push_fan(&mut mesh, &polygon, what)?;
            }
            _ => {}
        }
    }
    Ok(mesh)
}

/// The vertex of `v`, `v/vt`, `v//vn` or `v/vt/vn`, counted from 0. OBJ counts from 1, or back from the end by negative numbers.
fn vertex_index(word: &str, count: usize, what: impl Fn() -> String) -> Result<i64, Reason> {
    let number = word.split('/').next().unwrap_or_default();
    let index: i64 = number.parse().map_err(|_| format!("{}: {word:?} is not a vertex number", what()))?;
    match index {
        0 => Err(format!("{}: vertex 0; OBJ counts from 1", what())),
        i if i < 0 => Ok(i.saturating_add(count as i64)),
        i => Ok(i - 1),
    }
}

/// OBJ text; numbers are written so that they read back to the same bits.
pub(super) fn bytes(mesh: &SurfaceMesh) -> Vec<u8> {
    let mut out = String::from("# endowire surface, unit mm\n");
    for v in &mesh.vertices_mm {
        // Writing to a string cannot fail.
        let _ = writeln!(out, "v {} {} {}", v.x, v.y, v.z);
    }
    for [a, b, c] in &mesh.triangles {
        let _ = writeln!(out, "f {} {} {}", u64::from(*a) + 1, u64::from(*b) + 1, u64::from(*c) + 1);
    }
    out.into_bytes()
}
