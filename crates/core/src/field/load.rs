//! A field on the elements of a line.

use super::{Field, MaterialPoint};
use crate::Vec3;
use crate::rod::quadrature::{GAUSS, Point, hermite};
use crate::rod::{ElementData, PointSum, RodState, Stencils};
use crate::solve::{External, Sizes};

/// A point at which a field is asked, and the length that it stands for.
#[derive(Debug, Clone, Copy)]
struct Sample {
    element: usize,
    xi: f64,
    weight_mm: f64,
    instrument: usize,
    from_tip_mm: f64,
}

/// The energy of a line of elements in a field, or in a mean of two fields, as Newton's method asks for it.
#[derive(Debug, Clone)]
pub(crate) struct FieldLoad<'a> {
    /// Fields with their weights, and where each is asked: first samples of an element, then those of the next.
    parts: Vec<(&'a dyn Field, f64, Vec<Sample>)>,
    /// Sizes of forces and moments at the base.
    sizes: Sizes,
}

impl<'a> FieldLoad<'a> {
    /// That of fields with weights on a line whose nodes are so far from its tip, the sheath's first, mm. Instruments are in so far, the innermost first, mm;
    /// a device alone as far as its line is long.
    pub(crate) fn new(
        fields: impl IntoIterator<Item = (&'a dyn Field, f64)>,
        from_tip_mm: &[f64],
        inserted_mm: &[f64],
    ) -> Self {
        let line_mm = from_tip_mm.first().copied().unwrap_or(0.0);
        let alone = [line_mm];
        let inserted_mm = if inserted_mm.is_empty() { &alone } else { inserted_mm };
        let samples = |field: &dyn Field| {
            let mut samples = Vec::new();
            for (element, ends) in from_tip_mm.windows(2).enumerate() {
                for (instrument, inserted_mm) in inserted_mm.iter().enumerate() {
                    // The line's tip is that of the farthest instrument.
                    let ahead_mm = line_mm - inserted_mm;
                    let acts = field.acts_on(instrument);
                    let far = (ends[0] - ahead_mm).min(acts.end);
                    let near = (ends[1] - ahead_mm).max(acts.start).max(0.0);
                    if far <= near {
                        continue;
                    }
                    samples.extend(GAUSS.iter().map(|point| {
                        let from_tip_mm = far - point.xi * (far - near);
                        let xi = (ends[0] - ahead_mm - from_tip_mm) / (ends[0] - ends[1]);
                        Sample {
                            element,
                            xi,
                            weight_mm: point.weight * (far - near),
                            instrument,
                            from_tip_mm,
                        }
                    }));
                }
            }
            samples
        };
        let parts = fields.into_iter().map(|(field, weight)| (field, weight, samples(field))).collect();
        Self { parts, sizes: Sizes::default() }
    }

    /// The energy at a state, mJ.
    pub(crate) fn energy_mj(&self, elements: &[ElementData], state: &RodState) -> f64 {
        let each = self.parts.iter().flat_map(|(field, weight, samples)| {
            samples.iter().map(move |sample| {
                let value = field.density(&sample.point(elements, state)).value;
                weight * sample.weight_mm * (value - sample.reference(*field, state))
            })
        });
        each.sum()
    }
}

impl Sample {
    /// The point where the rod has it.
    fn point(&self, elements: &[ElementData], state: &RodState) -> MaterialPoint {
        let (e, h) = (self.element, elements[self.element].length);
        let [x0, x1] = [e, e + 1].map(|node| state.positions[node]);
        let [t0, t1] = [e, e + 1].map(|node| state.frames[node].t);
        let [w0, s0, w1, s1] = hermite(self.xi);
        let [chord, along, ahead] = Point::at(self.xi, 0.0).y;
        self.placed(
            x0 * w0 + x1 * w1 + (t0 * s0 + t1 * s1) * h,
            (x1 - x0) * (chord / h) + t0 * along + t1 * ahead,
        )
    }

    /// Energy density of the same material at the sheath's mouth, mJ/mm.
    fn reference(&self, field: &dyn Field, state: &RodState) -> f64 {
        field.density(&self.placed(state.positions[0], state.frames[0].t)).value
    }

    fn placed(&self, position_mm: Vec3, tangent: Vec3) -> MaterialPoint {
        let Self { instrument, from_tip_mm, .. } = *self;
        MaterialPoint { instrument, from_tip_mm, position_mm, tangent }
    }
}

impl External for FieldLoad<'_> {
    fn linearise(&mut self, elements: &[ElementData], state: &RodState, into: &mut dyn Stencils) {
        self.sizes = Sizes::default();
        let mut energy_mj = 0.0;
        for (field, weight, samples) in &self.parts {
            for of_element in samples.chunk_by(|a, b| a.element == b.element) {
                let e = of_element[0].element;
                let mut sum = PointSum::default();
                for sample in of_element {
                    let weight = weight * sample.weight_mm;
                    let density = field.density(&sample.point(elements, state));
                    energy_mj += weight * (density.value - sample.reference(*field, state));
                    self.sizes.force_n += weight * density.by_position.norm();
                    self.sizes.moment_nmm += weight * density.by_tangent.norm();
                    sum.add_directed((sample.xi, elements[e].length), weight, &density);
                }
                into.add_points(state, &elements[e], e, &sum);
            }
        }
        into.add_value(energy_mj);
    }

    fn value(&mut self, elements: &[ElementData], state: &RodState) -> f64 {
        self.energy_mj(elements, state)
    }

    fn sizes(&self) -> Sizes {
        self.sizes
    }
}
