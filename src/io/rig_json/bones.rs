//! Bones of a rig file: names resolved, heads and tails turned into rest transforms.

use super::document::Bone;
use super::error::RigError;
use crate::math::{Trs, euler};
use crate::skeleton::{BoneDesc, BoneId, Limits, Skeleton};
use glam::{Affine3A, DAffine3, DMat3, DQuat, DVec3, Mat3A, Quat, Vec3};
use std::collections::BTreeMap;

/// The skeleton of a file's bones.
pub fn skeleton(bones: &[Bone]) -> Result<Skeleton, RigError> {
    // Let the skeleton check the tree first: heads and tails need parents before children.
    let parents = parents(bones)?;
    let bare = |(b, parent): (&Bone, &Option<usize>)| BoneDesc { parent: *parent, ..BoneDesc::new(&b.name) };
    let (_, of) = Skeleton::new(bones.iter().zip(&parents).map(bare).collect())?;
    let mut order: Vec<usize> = (0..bones.len()).collect();
    order.sort_by_key(|i| of[*i]);

    // Walk from the roots down with the world frames of what has been placed; list bones in the skeleton's own order, so
    // that the order in the file leaves no trace.
    let mut world = vec![DAffine3::IDENTITY; bones.len()];
    let mut descs = Vec::with_capacity(bones.len());
    for i in order {
        let parent = parents[i].map_or(DAffine3::IDENTITY, |p| world[p]);
        let desc = describe(&bones[i], &parent)?;
        let local = desc.fixed.unwrap_or_else(|| desc.rest.to_affine());
        world[i] = parent * widen(&local);
        descs.push(BoneDesc { parent: parents[i].map(|p| of[p].index()), ..desc });
    }
    Ok(Skeleton::new(descs)?.0)
}

fn parents(bones: &[Bone]) -> Result<Vec<Option<usize>>, RigError> {
    let mut places = BTreeMap::new();
    for (i, b) in bones.iter().enumerate() {
        if let Some(before) = places.insert(b.name.as_str(), i) {
            let why = format!("names bones {before} and {i}; names must be unique");
            return Err(RigError::Name { place: "bones".into(), what: "bone", name: b.name.clone(), why });
        }
    }
    let parent = |b: &Bone| match &b.parent {
        None => Ok(None),
        Some(name) => places.get(name.as_str()).map(|i| Some(*i)).ok_or_else(|| RigError::Name {
            place: format!("bone `{}`", b.name),
            what: "parent",
            name: name.clone(),
            why: format!("is none of the {} bones", bones.len()),
        }),
    };
    bones.iter().map(parent).collect()
}

/// The one bone of that name.
pub fn find(skeleton: &Skeleton, name: &str, place: &str) -> Result<BoneId, RigError> {
    let mut all = skeleton.ids().filter(|b| skeleton.name(*b) == name);
    let why = match (all.next(), all.next()) {
        (Some(bone), None) => return Ok(bone),
        (None, _) => format!("is none of the {} bones", skeleton.len()),
        _ => format!("stands for {} bones; names must be unique", 2 + all.count()),
    };
    Err(RigError::Name { place: place.into(), what: "bone", name: name.into(), why })
}

fn describe(b: &Bone, world_from_parent: &DAffine3) -> Result<BoneDesc, RigError> {
    let place = format!("bone `{}`", b.name);
    let mut desc = match (b.head, b.tail) {
        (Some(head), Some(tail)) => by_head(b, head, tail, world_from_parent, &place)?,
        (None, None) => by_transform(b, &place)?,
        _ => return Err(RigError::value(place, "expected both `head` and `tail`, or neither")),
    };
    desc.limits = limits(b, &place)?;
    Ok(desc)
}

fn by_head(
    b: &Bone,
    head: [f32; 3],
    tail: [f32; 3],
    world_from_parent: &DAffine3,
    place: &str,
) -> Result<BoneDesc, RigError> {
    let [translation, rotation, xzx, scale] =
        [b.translation.is_some(), b.rotation.is_some(), b.xzx_deg.is_some(), b.scale.is_some()];
    let extra = [b.length.is_some(), b.aim.is_some(), b.fixed.is_some()];
    if translation || rotation || xzx || scale || extra.contains(&true) {
        let why = "`head` and `tail` say it all; remove `translation`, `rotation`, `xzx_deg`, `scale`, `length`, \
                   `aim` and `fixed`";
        return Err(RigError::value(place, why));
    }
    let axes = world_from_parent.matrix3;
    let unturned = axes.transpose() * axes;
    if !unturned.abs_diff_eq(DMat3::IDENTITY, 1e-4) {
        return Err(RigError::value(
            place,
            "`head` and `tail` need bones above that are neither scaled nor sheared",
        ));
    }
    let [from, to] = [head, tail].map(|p| Vec3::from_array(p).as_dvec3());
    let frame = frame(from, to, b.hinge.map(|h| Vec3::from_array(h).as_dvec3()), place)?;
    let parent = DQuat::from_mat3(&axes).normalize();
    let local = (parent.conjugate() * DQuat::from_mat3(&frame)).normalize();
    let rest = Trs {
        translation: (parent.conjugate() * (from - world_from_parent.translation)).as_vec3(),
        rotation: positive(local).as_quat(),
        scale: Vec3::ONE,
    };
    Ok(BoneDesc { rest, length: from.distance(to) as f32, ..BoneDesc::new(&b.name) })
}

/// The frame of a bone from head to tail: x along it, z the hinge made orthogonal, `y = z × x`.
///
/// Without a hinge, z is nearest to the world's +x, or to +y for bones within 37° of the x axis: legs, spines and
/// tails nod, arms that point sideways swing.
fn frame(from: DVec3, to: DVec3, hinge: Option<DVec3>, place: &str) -> Result<DMat3, RigError> {
    let x = (to - from).try_normalize().ok_or_else(|| {
        RigError::value(place, "`head` and `tail` are at one place; the bone has no direction")
    })?;
    let hinge = hinge.unwrap_or(if x.x.abs() > 0.8 { DVec3::Y } else { DVec3::X });
    let z = hinge - x * x.dot(hinge);
    if z.length() < 1e-3 * hinge.length().max(1e-9) || !z.is_finite() {
        return Err(RigError::value(place, "`hinge` must be an axis across the bone, not along it"));
    }
    let z = z.normalize();
    Ok(DMat3::from_cols(x, z.cross(x), z))
}

fn by_transform(b: &Bone, place: &str) -> Result<BoneDesc, RigError> {
    if b.hinge.is_some() {
        return Err(RigError::value(place, "`hinge` needs `head` and `tail`"));
    }
    let rotation = match (b.rotation, b.xzx_deg) {
        (Some(_), Some(_)) => {
            return Err(RigError::value(place, "expected `rotation` or `xzx_deg`, found both"));
        }
        (Some(q), None) => quaternion(q, "rotation", place)?,
        (None, Some(t)) => euler::rotation_from_xzx_f64(t.map(f64::to_radians)).as_quat(),
        (None, None) => Quat::IDENTITY,
    };
    let rest = Trs {
        translation: b.translation.map_or(Vec3::ZERO, Vec3::from_array),
        rotation,
        scale: b.scale.map_or(Vec3::ONE, Vec3::from_array),
    };
    let aim = b.aim.map_or(Ok(Quat::IDENTITY), |q| quaternion(q, "aim", place))?;
    let fixed = b.fixed.as_ref().map(affine);
    Ok(BoneDesc { rest, fixed, aim, length: b.length.unwrap_or(0.0), ..BoneDesc::new(&b.name) })
}

/// A unit quaternion as it stands; one that is nearly of length 1, as people round it, is normalised.
fn quaternion(q: [f32; 4], what: &str, place: &str) -> Result<Quat, RigError> {
    let q = Quat::from_array(q);
    let off = (q.length() - 1.0).abs();
    if off <= 1e-6 {
        Ok(q)
    } else if off <= 0.02 {
        Ok(q.normalize())
    } else {
        let why = format!("`{what}` must be a quaternion of length 1, found length {}", q.length());
        Err(RigError::value(place, why))
    }
}

fn limits(b: &Bone, place: &str) -> Result<Option<Limits>, RigError> {
    if b.min_deg.is_none() && b.max_deg.is_none() {
        return Ok(None);
    }
    let side = |of: &Option<[Option<f64>; 3]>, free: f32| {
        let v = of.unwrap_or_default().map(|v| v.map_or(free, |v| v.to_radians() as f32));
        Vec3::from_array(v)
    };
    let (min, max) = (side(&b.min_deg, f32::NEG_INFINITY), side(&b.max_deg, f32::INFINITY));
    match (0..3).find(|k| min[*k] > max[*k]) {
        None => Ok(Some(Limits { min, max })),
        Some(k) => Err(RigError::value(place, format!("`min_deg` is above `max_deg` for angle {}", k + 1))),
    }
}

/// Three rows of four as an affine map.
pub fn affine(rows: &[[f32; 4]; 3]) -> Affine3A {
    let column = |c: usize| Vec3::new(rows[0][c], rows[1][c], rows[2][c]);
    Affine3A {
        matrix3: Mat3A::from_cols(column(0).into(), column(1).into(), column(2).into()),
        translation: column(3).into(),
    }
}

/// The same map in f64.
pub fn widen(m: &Affine3A) -> DAffine3 {
    let a = m.matrix3;
    DAffine3 {
        matrix3: DMat3::from_cols(a.x_axis.as_dvec3(), a.y_axis.as_dvec3(), a.z_axis.as_dvec3()),
        translation: m.translation.as_dvec3(),
    }
}

fn positive(q: DQuat) -> DQuat {
    if q.w < 0.0 { -q } else { q }
}
