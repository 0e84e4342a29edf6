//! Shading of the 3D view. The WGSL shader has the same formulas, and reads the same numbers from a uniform.
//!
//! **Wall.** A thin sheet lit from the upper left, more opaque where it is seen edge-on (a light path through a sheet
//! is proportional to 1/cos), which draws the silhouettes that make a translucent tube readable. Farther parts fade
//! to the background. **Order independence** is that of McGuire and Bavoil (Journal of Computer Graphics Techniques
//! 2(2), 2013): the colours in front of the opaque scene are averaged with weights αw that decrease with distance,
//! and cover it by 1 − Π(1 − α).
//!
//! Colours are display values, blended without conversion.

use glam::{Vec3, Vec4};

use crate::three_d::Camera;

/// All constants of the shading.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Style {
    /// rgb of the background; w: how far the farthest wall fades to it.
    background: Vec4,
    /// rgb of the wall; w: how much darker its silhouettes are.
    wall: Vec4,
    /// w: strength of the highlight of solids.
    device: Vec4,
    /// Unit direction to the lamp; w: strength of the wall's highlight.
    lamp: Vec4,
    /// Opacity seen frontally and edge-on, exponent between them, light on inner sides.
    sheet: Vec4,
    /// Tangents of half the opening angles; nearest and farthest distance of the wall.
    frustum: Vec4,
    /// Near and far plane, only for the shader.
    #[cfg(feature = "gpu")]
    planes: Vec4,
}

impl Style {
    pub(crate) fn new(camera: &Camera) -> Self {
        let [tx, ty] = camera.tangents.map(|t| t as f32);
        let [front, rear] = camera.wall_range.map(|d| d as f32);
        Self {
            background: Vec4::new(0.965, 0.972, 0.980, 0.45),
            wall: Vec4::new(0.88, 0.35, 0.30, 0.50),
            device: Vec4::new(0.0, 0.0, 0.0, 0.45),
            lamp: Vec3::new(-0.45, 0.62, 0.64).normalize().extend(0.35),
            sheet: Vec4::new(0.22, 0.85, 2.0, 0.72),
            frustum: Vec4::new(tx, ty, front, rear),
            #[cfg(feature = "gpu")]
            planes: Vec4::new(camera.near as f32, camera.far as f32, 0.0, 0.0),
        }
    }

    /// The members in the order of the shader's uniform.
    #[cfg(feature = "gpu")]
    pub(crate) fn uniform(&self) -> [[f32; 4]; 7] {
        [self.background, self.wall, self.device, self.lamp, self.sheet, self.frustum, self.planes]
            .map(|v| v.to_array())
    }

    pub(crate) fn background(&self) -> Vec3 {
        self.background.truncate()
    }

    /// Colour of a solid's surface at a point in view coordinates.
    pub(crate) fn shade_solid(&self, position: Vec3, normal: Vec3, colour: Vec3) -> Vec3 {
        let to_eye = -position.normalize();
        let n = normal.normalize_or(to_eye);
        let lamp = self.lamp.truncate();
        let half = (lamp + to_eye).normalize();
        let light = 0.40 + 0.55 * n.dot(lamp).max(0.0) + 0.25 * n.dot(to_eye).max(0.0);
        let shine = self.device.w * n.dot(half).max(0.0).powf(24.0);
        (colour * light + shine).clamp(Vec3::ZERO, Vec3::ONE)
    }

    /// Colour and opacity of the wall at a point in view coordinates.
    pub(crate) fn shade_wall(&self, position: Vec3, normal: Vec3) -> Vec4 {
        let to_eye = -position.normalize();
        let outwards = normal.normalize_or(to_eye);
        let inner = outwards.dot(to_eye) < 0.0;
        let n = if inner { -outwards } else { outwards };
        let lamp = self.lamp.truncate();
        let half = (lamp + to_eye).normalize();
        let facing = n.dot(to_eye).min(1.0);
        let rim = (1.0 - facing).powf(self.sheet.z);
        let shine = if inner { 0.0 } else { self.lamp.w * n.dot(half).max(0.0).powf(40.0) };
        let light =
            (0.50 + 0.40 * n.dot(lamp).max(0.0) + 0.25 * facing) * if inner { self.sheet.w } else { 1.0 };
        let lit = self.wall.truncate() * light * (1.0 - self.wall.w * rim) + shine;
        let colour = lit.lerp(self.background(), self.background.w * self.depth(position));
        let alpha = self.sheet.x + (self.sheet.y - self.sheet.x) * rim + shine;
        colour.clamp(Vec3::ZERO, Vec3::ONE).extend(alpha.min(1.0))
    }

    /// Weight of a wall fragment among those on the same pixel.
    pub(crate) fn weight(&self, distance: f32) -> f32 {
        let zeta = self.depth(Vec3::new(0.0, 0.0, -distance));
        (1.0 - 0.95 * zeta).powi(3).max(0.02)
    }

    /// 0 at the nearest, 1 at the farthest wall.
    fn depth(&self, position: Vec3) -> f32 {
        let [front, rear] = [self.frustum.z, self.frustum.w];
        ((-position.z - front) / (rear - front).max(f32::MIN_POSITIVE)).clamp(0.0, 1.0)
    }
}
