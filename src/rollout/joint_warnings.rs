//! Joints that are valid and most likely not what their author means.

use super::asset_cache::AssetCache;
use softvt_common::text::format_number;
use softvt_geometry::Aabb;
use softvt_scene::{Asset, Joint, JointMotion, MovingPart};

/// Travel of a slider, as a multiple of the size of the object, that is likely given in another unit.
const MAX_TRAVEL_SHARE: f64 = 3.0;
/// Largest force with which the arm moves a part, N: several times its payload.
const MAX_PUSH_N: f64 = 100.0;
/// Speeds at which the standard experts move sliders, m/s, and hinges, rad/s.
const SLIDER_SPEED: f64 = 0.1;
const HINGE_SPEED: f64 = 0.6;

/// Warnings about the joints and parts of an articulated asset: the travel of sliders, origins of hinges, friction and
/// damping that no hand overcomes, and parts that are away from the rest of the object.
pub(super) fn joint_warnings(asset: &Asset, cache: &AssetCache) -> Vec<String> {
    let parts = asset.parts();
    if parts.is_empty() {
        return Vec::new();
    }
    let base = cache.bounds(&asset.shape);
    let bounds: Vec<Aabb> = parts.iter().map(|part| cache.bounds(&part.asset.shape)).collect();
    let whole = bounds.iter().fold(base, |sofar, part| sofar.merged(part));
    let of_part = |(index, part): (usize, &MovingPart)| {
        let others = bounds.iter().enumerate().filter(|(other, _)| *other != index);
        let nearest =
            others.map(|(_, other)| other).chain([&base]).map(|other| bounds[index].distance(other));
        let gap = nearest.fold(f64::INFINITY, f64::min);
        let found = [
            range_warning(&part.joint, &whole),
            resistance_warning(&part.joint, &bounds[index]),
            gap_warning(gap, &bounds[index]),
        ];
        found
            .into_iter()
            .flatten()
            .map(|warning| format!("part {}: {warning}", part.name))
            .collect::<Vec<_>>()
    };
    parts.iter().enumerate().flat_map(of_part).collect()
}

fn mm(metres: f64) -> String {
    format_number((1e4 * metres).round() / 10.0)
}

/// A warning about the travel of a slider or the origin of a hinge. `whole` bounds the object with all joints at 0.
fn range_warning(joint: &Joint, whole: &Aabb) -> Option<String> {
    let size = whole.size().max();
    match joint.motion {
        JointMotion::Slide => {
            let travel = (joint.upper - joint.lower).max(joint.upper.abs()).max(joint.lower.abs());
            (travel > MAX_TRAVEL_SHARE * size).then(|| {
                format!(
                    "its slider moves from {} to {} m, and the object is {} mm long; lengths are in metres",
                    format_number(joint.lower),
                    format_number(joint.upper),
                    mm(size)
                )
            })
        }
        JointMotion::Turn => {
            let origin = joint.origin_o;
            let away = whole.distance(&Aabb { min: origin, max: origin });
            (away > size).then(|| {
                format!(
                    "the origin of its hinge, ({}, {}, {}) m, is {} mm away from the object, which is {} mm long; lengths are in \
                     metres, in the frame of the whole object",
                    format_number(origin.x),
                    format_number(origin.y),
                    format_number(origin.z),
                    mm(away),
                    mm(size)
                )
            })
        }
    }
}

/// A warning about friction or damping that a hand does not overcome. `part` bounds the part.
fn resistance_warning(joint: &Joint, part: &Aabb) -> Option<String> {
    let (most, speed, unit, pace) = match joint.motion {
        JointMotion::Slide => (MAX_PUSH_N, SLIDER_SPEED, "N", "m/s"),
        JointMotion::Turn => (MAX_PUSH_N * part.size().max(), HINGE_SPEED, "N m", "rad/s"),
    };
    if joint.friction > most {
        return Some(format!(
            "its friction is {} {unit}, and the arm moves at most about {} {unit}; a drawer has about 1 N, a knob 0.01 N m",
            format_number(joint.friction),
            format_number(rounded(most)),
        ));
    }
    (joint.damping * speed > most).then(|| {
        format!(
            "its damping takes {} {unit} at {speed} {pace}, and the arm moves at most about {} {unit}; a drawer has about 6 N s/m, \
             a knob 0.002 N m s/rad",
            format_number(rounded(joint.damping * speed)),
            format_number(rounded(most)),
        )
    })
}

/// To a tenth, for messages.
fn rounded(value: f64) -> f64 {
    (10.0 * value).round() / 10.0
}

/// A warning about a part that is farther from the rest of the object than its own size, with all joints at 0.
fn gap_warning(gap: f64, part: &Aabb) -> Option<String> {
    let size = part.size().max();
    (gap > size).then(|| {
        format!(
            "it is {} mm away from the rest of the object, and {} mm long itself; shapes of parts are in the frame of the whole \
             object, with all joints at 0",
            mm(gap),
            mm(size)
        )
    })
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use softvt_geometry::{Vec3, shape::Shape};
    use softvt_physics::contact::Friction;
    use softvt_scene::Body;

    fn block(name: &str, body: Body) -> Asset {
        Asset {
            name: name.into(),
            shape: Shape::Box { half: Vec3::repeat(0.05) },
            body,
            friction: Friction::default(),
            visuals: Vec::new(),
            hints: Default::default(),
        }
    }

    /// Warnings about a block of 0.1 m on which one like it moves, displaced by `offset` (m) along x.
    fn warnings(joint: Joint, offset: f64) -> Vec<String> {
        let part = block("tray", Body::Rigid { density: 500.0 });
        let shape = part.shape.clone().translated(Vec3::new(offset, 0.0, 0.0));
        let part = MovingPart {
            name: "tray".into(),
            asset: Arc::new(Asset { shape, ..part }),
            density: 500.0,
            parent: None,
            joint,
        };
        joint_warnings(&block("chest", Body::Articulated(vec![part])), &AssetCache::approximate())
    }

    fn slider(upper: f64) -> Joint {
        Joint {
            motion: JointMotion::Slide,
            axis_o: -Vec3::x(),
            origin_o: Vec3::zeros(),
            lower: 0.0,
            upper,
            damping: 6.0,
            friction: 1.0,
        }
    }

    fn hinge(origin_o: Vec3) -> Joint {
        Joint { motion: JointMotion::Turn, origin_o, damping: 2e-3, friction: 8e-3, ..slider(1.0) }
    }

    #[test]
    fn joints_in_other_units_and_stiff_ones_are_doubted() {
        assert_eq!(warnings(slider(0.1), 0.1), [""; 0]);
        assert_eq!(warnings(hinge(Vec3::new(0.15, 0.0, 0.0)), 0.1), [""; 0]);
        let long = warnings(slider(100.0), 0.1);
        let expected = "part tray: its slider moves from 0 to 100 m, and the object is 200 mm long; lengths are in metres";
        assert_eq!(long, [expected]);
        let far = warnings(hinge(Vec3::new(0.0, 80.0, 0.0)), 0.1);
        assert!(
            far[0].starts_with("part tray: the origin of its hinge, (0, 80, 0) m, is 79950 mm away"),
            "{far:?}"
        );
        let stuck = warnings(Joint { friction: 1e6, ..slider(0.1) }, 0.1);
        assert!(
            stuck[0].contains("its friction is 1000000 N, and the arm moves at most about 100 N"),
            "{stuck:?}"
        );
        let thick = warnings(Joint { damping: 1e9, ..hinge(Vec3::zeros()) }, 0.1);
        assert!(thick[0].contains("its damping takes 600000000 N m at 0.6 rad/s"), "{thick:?}");
    }

    #[test]
    fn a_part_away_from_its_object_is_doubted() {
        assert_eq!(warnings(slider(0.1), 0.19), [""; 0]);
        let away = warnings(slider(0.1), 1.0);
        assert!(away[0].starts_with("part tray: it is 900 mm away from the rest of the object"), "{away:?}");
    }
}
