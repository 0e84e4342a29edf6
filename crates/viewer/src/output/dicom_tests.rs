//! Files as other programs read them.

use endowire_core::Vec3;
use endowire_core::vessel::SurfaceMesh;

use super::*;
use crate::spec::{CArmSpec, Shutter};

#[test]
fn geometry_and_pixels_read_back() {
    let wall = SurfaceMesh { vertices_mm: vec![Vec3::zeros(), Vec3::repeat(10.0)], triangles: vec![] };
    let spec = CArmSpec {
        primary_deg: -30.0,
        secondary_deg: 20.0,
        pixel_mm: Some(0.3),
        collimation_mm: Some([0.6, 5.0]),
        ..CArmSpec::default()
    };
    let c_arm = CArm::new(&spec, [4, 2], &wall).unwrap();
    let frame = |k: u8| Image::new(4, 2, PixelFormat::Gray16, (0..16).map(|i| 16 * k + i).collect());
    let frames = [frame(1), frame(2), frame(3)];
    let angiogram = angiogram(&c_arm, Mode::Cine);
    let path = std::env::temp_dir().join(format!("endowire-{}.dcm", std::process::id()));
    angiogram.write(&path, &frames).unwrap();
    let read = dicom_object::open_file(&path).unwrap();
    std::fs::remove_file(&path).unwrap();
    let float = |tag| read.element(tag).unwrap().to_float64().unwrap();
    assert_eq!(float(tags::POSITIONER_PRIMARY_ANGLE), -30.0);
    assert_eq!(float(tags::POSITIONER_SECONDARY_ANGLE), 20.0);
    assert_eq!(float(tags::DISTANCE_SOURCE_TO_DETECTOR), 1100.0);
    assert_eq!(float(tags::DISTANCE_SOURCE_TO_PATIENT), 750.0);
    assert_eq!(float(tags::FRAME_TIME), 80.0);
    assert_eq!(read.element(tags::IMAGER_PIXEL_SPACING).unwrap().to_multi_float64().unwrap(), [0.3, 0.3]);
    assert_eq!(float(tags::NUMBER_OF_FRAMES), 3.0);
    assert_eq!(float(tags::COLLIMATOR_LEFT_VERTICAL_EDGE), 1.0);
    let pixels = read.element(tags::PIXEL_DATA).unwrap().to_multi_int::<u16>().unwrap();
    assert_eq!(pixels.len(), 24);
    assert_eq!(pixels[9], u16::from_be_bytes([34, 35]));
    assert!(angiogram.write(&path, &[]).is_err());
}

fn angiogram(c_arm: &CArm, mode: Mode) -> Angiogram<'_> {
    Angiogram {
        c_arm,
        turn_deg: 0.0,
        exposure: Exposure { kvp: 80.0, dose_ngy: 30.0, entrance_ngy: 9000.0, tissue_mm: 200.0, pulse: None },
        pace: Pace::even(12.5),
        mode,
        mask: None,
        contrast: mode == Mode::Dsa,
        description: "test",
    }
}

fn arm(primary_deg: f64, rotation_deg: f64) -> CArm {
    let wall = SurfaceMesh { vertices_mm: vec![Vec3::zeros(), Vec3::repeat(10.0)], triangles: vec![] };
    let spec = CArmSpec {
        primary_deg,
        rotation_deg,
        pixel_mm: Some(0.3),
        collimation_mm: Some([3.0, 5.0]),
        ..CArmSpec::default()
    };
    CArm::new(&spec, [16, 16], &wall).unwrap()
}

fn octagon() -> CArm {
    let wall = SurfaceMesh { vertices_mm: vec![Vec3::zeros(), Vec3::repeat(10.0)], triangles: vec![] };
    let spec = CArmSpec { pixel_mm: Some(0.3), shutter: Shutter::Octagon, ..CArmSpec::default() };
    CArm::new(&spec, [16, 16], &wall).unwrap()
}

fn frames(format: PixelFormat) -> Vec<Image> {
    let frame = |k: usize| {
        let bytes = (0..256 * format.bytes()).map(|i| (i * 7 + k) as u8).collect();
        Image::new(16, 16, format, bytes)
    };
    vec![frame(1), frame(2), frame(3)]
}

/// Errors reported by the validator of dicom3tools; `None` if it is not installed.
fn errors(path: &Path) -> Option<Vec<String>> {
    let output = std::process::Command::new("dciodvfy").arg(path).output().ok()?;
    let text = String::from_utf8_lossy(&[output.stdout, output.stderr].concat()).into_owned();
    assert!(text.contains("XAImage"), "{text}");
    Some(text.lines().filter(|line| line.starts_with("Error")).map(str::to_owned).collect())
}

#[test]
fn a_validator_finds_no_error_in_any_mode_and_in_both_planes() {
    let folder = tempfile::tempdir().unwrap();
    let [arm_a, arm_b] = [arm(-30.0, 0.0), arm(60.0, 90.0)];
    let mut paths = Vec::new();
    for (name, mode) in
        [("live", Mode::Fluoro), ("cine", Mode::Cine), ("dsa", Mode::Dsa), ("roadmap", Mode::Roadmap)]
    {
        for format in [PixelFormat::Gray8, PixelFormat::Gray16] {
            let path = folder.path().join(format!("{name}_{}.dcm", format.bytes()));
            angiogram(&arm_a, mode).write(&path, &frames(format)).unwrap();
            paths.push(path);
        }
    }
    let pair = ["a.dcm", "b.dcm"].map(|name| folder.path().join(name));
    let pixels = frames(PixelFormat::Gray8);
    let planes = [angiogram(&arm_a, Mode::Cine), angiogram(&arm_b, Mode::Cine)];
    Angiogram::write_biplane([&planes[0], &planes[1]], [&pair[0], &pair[1]], [&pixels, &pixels]).unwrap();
    paths.extend(pair);
    let turning = folder.path().join("turning.dcm");
    let mut turn = Angiogram { turn_deg: 1.5, ..angiogram(&arm_a, Mode::Dsa) };
    turn.exposure.pulse = Some(Pulse { current_ma: 123.4, pulse_ms: 7.5 });
    turn.write(&turning, &pixels).unwrap();
    let read = dicom_object::open_file(&turning).unwrap();
    let reported = read.element(tags::POSITIONER_PRIMARY_ANGLE_INCREMENT).unwrap().to_float64().unwrap();
    assert_eq!(
        (reported, read.element(tags::POSITIONER_MOTION).unwrap().to_str().unwrap().trim()),
        (1.5, "DYNAMIC")
    );
    let float = |tag| read.element(tag).unwrap().to_float64().unwrap();
    assert!(read.element(tags::FRAME_TIME_VECTOR).is_err() && float(tags::FRAME_TIME) == 80.0);
    assert_eq!((float(tags::X_RAY_TUBE_CURRENT), float(tags::EXPOSURE_INU_AS)), (123.0, 926.0));
    paths.push(turning);
    // A mask before its frames, in an octagon.
    let masked = folder.path().join("masked.dcm");
    let sixteen = frames(PixelFormat::Gray16);
    let octagon = octagon();
    let subtraction = Angiogram { mask: Some(&sixteen[0]), ..angiogram(&octagon, Mode::Dsa) };
    subtraction.write(&masked, &sixteen[1..]).unwrap();
    let read = dicom_object::open_file(&masked).unwrap();
    let text = |tag| read.element(tag).unwrap().to_str().unwrap().trim().to_owned();
    assert_eq!(text(tags::RECOMMENDED_VIEWING_MODE), "SUB");
    assert_eq!(text(tags::PIXEL_INTENSITY_RELATIONSHIP), "LOG");
    assert!(text(tags::IMAGE_TYPE).starts_with("ORIGINAL"));
    assert_eq!(text(tags::NUMBER_OF_FRAMES), "3");
    assert_eq!(text(tags::COLLIMATOR_SHAPE), "POLYGONAL");
    let items = read.element(tags::MASK_SUBTRACTION_SEQUENCE).unwrap().items().unwrap();
    let numbers = |tag| items[0].element(tag).unwrap().to_multi_int::<u16>().unwrap();
    assert_eq!(numbers(tags::MASK_FRAME_NUMBERS), [1]);
    assert_eq!(numbers(tags::APPLICABLE_FRAME_RANGE), [2, 3]);
    let stored = read.element(tags::PIXEL_DATA).unwrap().to_multi_int::<u16>().unwrap();
    assert_eq!(stored[..256], words(&sixteen[0]).collect::<Vec<_>>());
    paths.push(masked);
    // Unequally spaced frames, and less than one per second.
    let uneven = folder.path().join("uneven.dcm");
    let pace = Pace::of(&[1.0, 2.2, 5.2], 15.0);
    Angiogram { pace, ..angiogram(&arm_a, Mode::Fluoro) }.write(&uneven, &pixels).unwrap();
    let read = dicom_object::open_file(&uneven).unwrap();
    let reported = read.element(tags::FRAME_TIME_VECTOR).unwrap().to_multi_float64().unwrap();
    assert_eq!(reported, [0.0, 1200.0, 3000.0]);
    let pointer = read.element(tags::FRAME_INCREMENT_POINTER).unwrap();
    assert_eq!(pointer.value().to_tag().unwrap(), tags::FRAME_TIME_VECTOR);
    assert!([tags::FRAME_TIME, tags::CINE_RATE].iter().all(|tag| read.element(*tag).is_err()));
    paths.push(uneven);
    for path in &paths {
        match errors(path) {
            Some(errors) => assert!(errors.is_empty(), "{}: {errors:#?}", path.display()),
            None => {
                assert!(std::env::var_os("ENDOWIRE_REQUIRE_DCIODVFY").is_none(), "install dicom3tools");
                eprintln!("skipped: dciodvfy (dicom3tools) is not installed");
                return;
            }
        }
    }
    // Counter-check: a file that does not specify its image type.
    let mut object = planes[0].object(&pixels, &pixels[0], Plane::Single);
    object.remove_element(tags::IMAGE_TYPE);
    let meta = FileMetaTableBuilder::new()
        .transfer_syntax(uids::EXPLICIT_VR_LITTLE_ENDIAN)
        .media_storage_sop_class_uid(uids::X_RAY_ANGIOGRAPHIC_IMAGE_STORAGE);
    let path = folder.path().join("twin.dcm");
    object.with_meta(meta).unwrap().write_to_file(&path).unwrap();
    assert!(!errors(&path).unwrap().is_empty());
}

#[test]
fn what_has_the_same_name_has_the_same_pixels_and_geometry() {
    let [one, other, turned] = [arm(-30.0, 0.0), arm(-30.1, 0.0), arm(-30.0, 90.0)];
    let pixels = frames(PixelFormat::Gray8);
    let uid = |arm: &CArm, mode: Mode, frames: &[Image]| {
        let object = angiogram(arm, mode).object(frames, &frames[0], Plane::Single);
        object.element(tags::SOP_INSTANCE_UID).unwrap().to_str().unwrap().into_owned()
    };
    let own = uid(&one, Mode::Cine, &pixels);
    assert_eq!(own, uid(&one, Mode::Cine, &pixels));
    let others = [
        uid(&other, Mode::Cine, &pixels),
        uid(&turned, Mode::Cine, &pixels),
        uid(&one, Mode::Fluoro, &pixels),
        uid(&one, Mode::Cine, &pixels[1..]),
    ];
    assert!(others.iter().all(|uid| *uid != own) && others[0] != others[1]);
}
