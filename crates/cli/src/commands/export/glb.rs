//! Documents of glTF 2.0 in their binary form (`.glb`): numbers in one buffer, and what they are in JSON.

use serde_json::{Value, json};

/// Types of numbers, by their codes in glTF.
const FLOAT: u32 = 5126;
const UNSIGNED_INT: u32 = 5125;
const UNSIGNED_SHORT: u32 = 5123;
/// What a view of the buffer is for.
const VERTICES: u32 = 34_962;
const INDICES: u32 = 34_963;

/// A document that grows.
#[derive(Default)]
pub(super) struct Glb {
    bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
    pub(super) nodes: Vec<Value>,
    pub(super) meshes: Vec<Value>,
    pub(super) materials: Vec<Value>,
    pub(super) skins: Vec<Value>,
    channels: Vec<Value>,
    samplers: Vec<Value>,
}

/// Number of numbers of an element.
fn width(kind: &str) -> usize {
    match kind {
        "SCALAR" => 1,
        "VEC3" => 3,
        "MAT4" => 16,
        _ => 4,
    }
}

impl Glb {
    fn view(&mut self, bytes: impl Iterator<Item = u8>, target: Option<u32>) -> usize {
        let offset = self.bytes.len();
        self.bytes.extend(bytes);
        let length = self.bytes.len() - offset;
        // Numbers lie at multiples of their size.
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        let mut view = json!({"buffer": 0, "byteOffset": offset, "byteLength": length});
        if let Some(target) = target {
            view["target"] = target.into();
        }
        self.views.push(view);
        self.views.len() - 1
    }

    fn floats(&mut self, numbers: &[f32], kind: &str, target: Option<u32>) -> Value {
        let view = self.view(numbers.iter().flat_map(|x| x.to_le_bytes()), target);
        json!({"bufferView": view, "componentType": FLOAT, "count": numbers.len() / width(kind), "type": kind})
    }

    fn accessor(&mut self, accessor: Value) -> usize {
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }

    /// Numbers of vertices.
    pub(super) fn vertices(&mut self, numbers: &[f32], kind: &str) -> usize {
        let accessor = self.floats(numbers, kind, Some(VERTICES));
        self.accessor(accessor)
    }

    /// Places of vertices, whose bounds are written.
    pub(super) fn places(&mut self, numbers: &[f32]) -> usize {
        let accessor = self.floats(numbers, "VEC3", Some(VERTICES));
        self.bounded(accessor, numbers, 3)
    }

    fn bounded(&mut self, mut accessor: Value, numbers: &[f32], width: usize) -> usize {
        let bound = |better: fn(f32, f32) -> f32, from: f32| -> Vec<f32> {
            (0..width).map(|k| numbers.iter().skip(k).step_by(width).copied().fold(from, better)).collect()
        };
        accessor["min"] = json!(bound(f32::min, f32::INFINITY));
        accessor["max"] = json!(bound(f32::max, f32::NEG_INFINITY));
        self.accessor(accessor)
    }

    /// Corners of triangles.
    pub(super) fn triangles(&mut self, corners: &[u32]) -> usize {
        let view = self.view(corners.iter().flat_map(|x| x.to_le_bytes()), Some(INDICES));
        let count = corners.len();
        self.accessor(
            json!({"bufferView": view, "componentType": UNSIGNED_INT, "count": count, "type": "SCALAR"}),
        )
    }

    /// One joint for each vertex, that moves it alone.
    pub(super) fn joints(&mut self, joints: &[u16]) -> [usize; 2] {
        let four = joints.iter().flat_map(|joint| [*joint, 0, 0, 0]);
        let view = self.view(four.flat_map(u16::to_le_bytes), Some(VERTICES));
        let count = joints.len();
        let of = self.accessor(
            json!({"bufferView": view, "componentType": UNSIGNED_SHORT, "count": count, "type": "VEC4"}),
        );
        [of, self.vertices(&[1.0, 0.0, 0.0, 0.0].repeat(count), "VEC4")]
    }

    /// Numbers that are no vertices: matrices, keys of an animation.
    pub(super) fn numbers(&mut self, numbers: &[f32], kind: &str) -> usize {
        let accessor = self.floats(numbers, kind, None);
        self.accessor(accessor)
    }

    /// Times of keys, s.
    pub(super) fn times(&mut self, times_s: &[f32]) -> usize {
        let accessor = self.floats(times_s, "SCALAR", None);
        self.bounded(accessor, times_s, 1)
    }

    pub(super) fn node(&mut self, node: Value) -> usize {
        self.nodes.push(node);
        self.nodes.len() - 1
    }

    pub(super) fn mesh(&mut self, mesh: Value) -> usize {
        self.meshes.push(mesh);
        self.meshes.len() - 1
    }

    /// Moves a property ("translation", "rotation", "scale", "weights") of a node, by keys at these times.
    pub(super) fn animate(
        &mut self,
        node: usize,
        path: &str,
        times: usize,
        keys: usize,
        interpolation: &str,
    ) {
        let sampler = self.samplers.len();
        self.samplers.push(json!({"input": times, "output": keys, "interpolation": interpolation}));
        self.channels.push(json!({"sampler": sampler, "target": {"node": node, "path": path}}));
    }

    /// The file of a scene with these nodes.
    pub(super) fn file(self, scene: &[usize], extras: &Value) -> Vec<u8> {
        let mut document = json!({
            "asset": {"version": "2.0", "generator": concat!("endowire ", env!("CARGO_PKG_VERSION")), "extras": extras},
            "scene": 0,
            "scenes": [{"nodes": scene}],
            "buffers": [{"byteLength": self.bytes.len()}],
            "bufferViews": self.views,
            "accessors": self.accessors,
            "nodes": self.nodes,
            "meshes": self.meshes,
            "materials": self.materials,
        });
        // Empty lists are not allowed.
        if !self.skins.is_empty() {
            document["skins"] = self.skins.into();
        }
        if !self.channels.is_empty() {
            document["animations"] =
                json!([{"name": "run", "channels": self.channels, "samplers": self.samplers}]);
        }
        let mut text = document.to_string().into_bytes();
        text.resize(text.len().next_multiple_of(4), b' ');
        let length = 12 + 8 + text.len() + 8 + self.bytes.len();
        let mut file = b"glTF".to_vec();
        for number in [2, length as u32, text.len() as u32] {
            file.extend(number.to_le_bytes());
        }
        file.extend(b"JSON");
        file.extend(text);
        file.extend((self.bytes.len() as u32).to_le_bytes());
        file.extend(b"BIN\0");
        file.extend(self.bytes);
        file
    }
}
