//! Union and difference of closed parts, by the Manifold algorithm: exact in its decisions, manifold in its results.

use manifold_rust::manifold::Manifold;
use manifold_rust::types::{BooleanEngine, Error as Status, MeshGL64, OpType};

use super::overlap::Closed;
use crate::Vec3;

/// A closed part on its way through unions and differences.
pub(super) struct Solid(Manifold);

impl Solid {
    /// `None` if the triangles do not close.
    pub(super) fn new(part: &Closed) -> Option<Self> {
        let mesh = MeshGL64 {
            num_prop: 3,
            vert_properties: part.vertices_mm.iter().flat_map(|v| [v.x, v.y, v.z]).collect(),
            tri_verts: part.triangles.iter().flat_map(|(t, _)| t.map(u64::from)).collect(),
            face_id: part.triangles.iter().map(|(_, number)| u64::from(*number)).collect(),
            ..MeshGL64::default()
        };
        Self::usable(Manifold::from_mesh_gl64(&mesh))
    }

    fn usable(made: Manifold) -> Option<Self> {
        (made.status() == Status::NoError && !made.is_empty()).then_some(Self(made))
    }

    /// Everything that is in one of the two; `None` if it could not be computed.
    pub(super) fn with(&self, other: &Self) -> Option<Self> {
        Self::usable(self.0.boolean_with_engine(&other.0, OpType::Add, BooleanEngine::Exact))
    }

    /// What is in this one alone; `None` if nothing is, or it could not be computed.
    pub(super) fn without(&self, other: &Self) -> Option<Self> {
        Self::usable(self.0.boolean_with_engine(&other.0, OpType::Subtract, BooleanEngine::Exact))
    }

    /// The volume that both enclose, mm³; 0 if it could not be computed.
    pub(super) fn common_mm3(&self, other: &Self) -> f64 {
        let common = self.0.boolean_with_engine(&other.0, OpType::Intersect, BooleanEngine::Exact);
        Self::usable(common).map_or(0.0, |common| common.volume_mm3())
    }

    /// The volume that it encloses, mm³.
    pub(super) fn volume_mm3(&self) -> f64 {
        self.0.volume()
    }

    /// Its triangles, with the numbers of those that they are parts of.
    pub(super) fn triangles(&self) -> Closed {
        let mesh = self.0.get_mesh_gl64(-1);
        let width = mesh.num_prop.max(3) as usize;
        let vertices_mm =
            mesh.vert_properties.chunks_exact(width).map(|v| Vec3::new(v[0], v[1], v[2])).collect();
        // Vertices that differ in nothing but where they come from.
        let mut same: Vec<u32> = (0..mesh.num_vert() as u32).collect();
        for (from, to) in mesh.merge_from_vert.iter().zip(&mesh.merge_to_vert) {
            same[*from as usize] = *to as u32;
        }
        let corners = mesh.tri_verts.chunks_exact(3).map(|t| [t[0], t[1], t[2]].map(|v| same[v as usize]));
        let numbers = mesh.face_id.iter().map(|number| *number as u32);
        Closed { vertices_mm, triangles: corners.zip(numbers).collect() }
    }
}
