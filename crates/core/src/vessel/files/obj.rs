//! Wavefront OBJ: `v` and `f` lines; all objects and groups form one surface.
//!
//! Own implementation, because the crate for it (tobj 4.0) splits a surface by object, group and material into models
//! with separate vertices, and keeps 64-bit numbers only by a feature that would affect every other crate in a build.

use std::fmt::Write;

use super::faces::Faces;
use super::{Parsed, Reason};
use crate::text::lines;
use crate::vessel::SurfaceMesh;

pub(super) fn parse(bytes: &[u8]) -> Result<Parsed, Reason> {
    // Comments and names may be in any encoding; only ASCII matters.
    let text = String::from_utf8_lossy(bytes);
    let (mut parsed, mut faces) = (Parsed::default(), Faces::default());
    // Text of continued lines so far.
    let mut begun = String::new();
    for (number, line) in lines(&text) {
        let content = match line.split_once('#') {
            Some((content, comment)) => {
                parsed.axes.look_in(comment);
                content
            }
            None => match line.trim_end().strip_suffix('\\') {
                Some(part) => {
                    begun += part;
                    begun.push(' ');
                    continue;
                }
                None => line,
            },
        };
        if begun.is_empty() {
            statement(content, number, &mut parsed.mesh, &mut faces)?;
        } else {
            begun += content;
            statement(&std::mem::take(&mut begun), number, &mut parsed.mesh, &mut faces)?;
        }
    }
    if !begun.is_empty() {
        return Err("the last line goes on (\\), but nothing follows: the file is cut off".into());
    }
    faces.fill(&mut parsed.mesh, |number| format!("line {number}"))?;
    Ok(parsed)
}

/// Processes a line without its comment; `number` is that of its end.
fn statement(line: &str, number: usize, mesh: &mut SurfaceMesh, faces: &mut Faces) -> Result<(), Reason> {
    let mut words = line.split_whitespace();
    let what = || format!("line {number}");
    match words.next() {
        Some("v") => mesh.vertices_mm.push(super::coordinates(words, what)?),
        Some("f") => {
            let count = mesh.vertices_mm.len();
            let polygon: Vec<i64> =
                words.map(|word| vertex_index(word, count, what)).collect::<Result<_, _>>()?;
            faces.push(polygon, number);
        }
        _ => {}
    }
    Ok(())
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
