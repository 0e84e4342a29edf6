//! How large pictures are drawn: as large as they are shown, if the machine can.

/// Time that a live frame may take, ms, so that 30 a second leave room for everything else.
const FRAME_MS: f64 = 20.0;
/// Smallest and largest side of a picture, pixels, and the steps between: a change has the room drawn anew.
const SIDES_PX: [u32; 2] = [384, 1024];
const STEP_PX: u32 = 64;
/// Ratio of sides up to which a picture stays as it is.
const ALIKE: f64 = 1.2;

/// The side in pixels at which pictures should be drawn that are shown `shown_px` a side, if one of `side_px` takes
/// `frame_ms`.
pub fn fitting_side(shown_px: u32, side_px: u32, frame_ms: f64) -> u32 {
    let [least, most] = SIDES_PX;
    let now = f64::from(side_px);
    let in_time = now * (FRAME_MS / frame_ms.max(0.1)).sqrt();
    let wanted = in_time.min(f64::from(shown_px)).clamp(f64::from(least), f64::from(most));
    let is_alike = (1.0 / ALIKE..ALIKE).contains(&(wanted / now));
    if is_alike { side_px } else { wanted as u32 / STEP_PX * STEP_PX }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_are_as_large_as_shown_where_there_is_time_and_stay_where_they_are_about_that() {
        assert_eq!(fitting_side(900, 512, 4.0), 896);
        assert_eq!(fitting_side(900, 896, 12.0), 896, "as large as shown");
        assert_eq!(fitting_side(3000, 512, 1.0), 1024, "and no larger than a detector");
        // A slow machine has the smallest.
        assert_eq!(fitting_side(900, 512, 80.0), 384);
        assert_eq!(fitting_side(900, 512, 19.0), 512);
        assert_eq!(fitting_side(300, 512, 4.0), 384, "a small window");
        // It settles: what a side takes is as its area.
        let mut side = 512;
        let after: Vec<u32> = (0..6)
            .map(|_| {
                side = fitting_side(2000, side, 11.0 * (f64::from(side) / 512.0).powi(2));
                side
            })
            .collect();
        assert!(after[1..].iter().all(|one| *one == after[1]), "{after:?}");
    }
}
