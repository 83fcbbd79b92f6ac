//! Vertices in integers, as coarse as the tolerance leaves room for.

use super::clips::Edited;
use super::{Args, write};
use crate::cli::{Failure, say::Say};
use serde_json::{Value, json};
use sinew::bake::BakeDesc;
use sinew::bake::vertices::{self, Cost};
use sinew::character::{Binding, Character};
use sinew::clip::Clip;
use sinew::io::gltf::{self, MeshForm};
use sinew::io::{Import, Options};
use std::collections::BTreeMap;
use std::path::Path;

/// What of the tolerance the vertices may take; the clips have what is left.
const PART: f64 = 1.0 / 3.0;

/// Groups of meshes that are made finer one by one; beyond, all are.
const TRIES: usize = 40;

/// Vertices that are to be written, and what they cost.
pub(super) struct Quantized {
    pub character: Character,
    /// By groups of meshes; those that are missing are the coarsest.
    pub forms: BTreeMap<usize, MeshForm>,
    /// Metres that no vertex exceeds in any clip.
    pub error: f64,
    pub told: Value,
}

/// The coarsest vertices that cost no more than a part of the tolerance in these clips, and at rest where there are none.
pub(super) fn quantized(
    args: &Args,
    input: &Path,
    import: &Import,
    edited: &[Edited],
    desc: &BakeDesc,
    say: &Say,
) -> Result<Quantized, Failure> {
    if import.format != "glTF" {
        let message = "--quantize-mesh: from glTF to glTF only; bake to a .glb first, then that one";
        return Err(Failure::Usage(message.into()));
    }
    let bad = |e: &dyn std::fmt::Display| Failure::Input(format!("{}: {e}", input.display()));
    let file = write::rewritten(args, input, import, &[], Default::default())?;
    if let Some(extension) = file.stranger() {
        let message = format!("--quantize-mesh: `{extension}` may say more of the vertices; remove it first");
        return Err(Failure::Usage(message));
    }
    let mut forms = BTreeMap::new();
    let limit = PART * desc.tolerance;
    for tries in 0.. {
        let mut out = file.clone();
        let groups = out.quantize(&forms).map_err(|e| bad(&e))?;
        let name = input.display().to_string();
        let other = gltf::import_bytes(&out.glb(), None, &name, &Options { textures: false });
        let other = other.map_err(|e| bad(&e))?;
        let character = gltf::vertices_of(import, &other).ok_or_else(|| {
            bad(&"--quantize-mesh: its vertices cannot be compared with what becomes of them")
        })?;
        let cost = worst(
            &import.asset.character,
            &character,
            edited,
            &BakeDesc { tolerance: limit, ..desc.clone() },
        );
        let Some(instance) = cost.1.filter(|_| cost.0.ceiling > limit) else {
            let error = cost.0.ceiling;
            let told = told(&out, import, &character, &cost.0, limit);
            say.note(&format!(
                "vertices in integers: at most {:.4} mm off; {} of {} meshes have 16-bit positions, normals are up to {:.2}° off",
                1e3 * error, told["positions16"], told["meshes"], told["normals"].as_f64().unwrap_or(0.0),
            ));
            return Ok(Quantized { character, forms, error, told });
        };
        let at = groups[import.primitives[instance].mesh as usize];
        let skinned = |g: usize| {
            let mut of = import.primitives.iter().zip(import.asset.character.instances());
            of.any(|(p, i)| groups[p.mesh as usize] == g && matches!(i.binding, Binding::Skin { .. }))
        };
        let these: Vec<usize> = if tries < TRIES { vec![at] } else { groups.clone() };
        for g in these {
            let form: &mut MeshForm = forms.entry(g).or_default();
            *form = finer(*form, skinned(g)).unwrap_or(*form);
        }
        if tries > TRIES + 5 {
            return Err(Failure::Differs(format!(
                "{}: --quantize-mesh: {:.4} mm off where a third of the tolerance is {:.4} mm; ask for more",
                input.display(),
                1e3 * cost.0.ceiling,
                1e3 * limit,
            )));
        }
    }
    unreachable!("it ends within")
}

/// The next of the forms, coarsest first: 8 bits of weight cost most, then the rest about as much as each other.
fn finer(form: MeshForm, skinned: bool) -> Option<MeshForm> {
    match (form.positions, form.weights) {
        (true, _) if !skinned => Some(MeshForm { positions: false, weights: 8 }),
        (true, 8) => Some(MeshForm { positions: true, weights: 16 }),
        (true, 16) => Some(MeshForm { positions: true, weights: 32 }),
        (true, _) => Some(MeshForm { positions: false, weights: 16 }),
        (false, 16) => Some(MeshForm { positions: false, weights: 32 }),
        _ => None,
    }
}

/// The clip of highest cost, and the instance that is to blame.
pub(super) fn worst(
    c: &Character,
    changed: &Character,
    edited: &[Edited],
    desc: &BakeDesc,
) -> (Cost, Option<usize>) {
    let mut worst = (Cost::default(), None);
    let rest = Clip::default();
    let alone = [(&rest, None)];
    let clips: Vec<_> = edited.iter().map(|e| (&e.clip, e.over.clone())).collect();
    for (clip, over) in if clips.is_empty() { alone.to_vec() } else { clips } {
        let cost = vertices::changed(c, changed, clip, &BakeDesc { over, ..desc.clone() });
        if cost.ceiling > worst.0.ceiling {
            let instance = match cost.worst.spot {
                Some(sinew::bake::Spot::Vertex { instance, .. }) => Some(instance),
                _ => None,
            };
            worst = (cost, instance);
        }
        if cost.ceiling > desc.tolerance {
            break;
        }
    }
    worst
}

fn told(out: &gltf::Rewritten, import: &Import, changed: &Character, cost: &Cost, limit: f64) -> Value {
    let list = |key: &str| out.json.get(key).and_then(Value::as_array).map_or(&[][..], Vec::as_slice);
    let small = |mesh: &&Value| {
        let position = mesh["primitives"][0]["attributes"]["POSITION"].as_u64();
        position.is_some_and(|a| list("accessors")[a as usize]["componentType"] == 5122)
    };
    json!({
        "meshes": list("meshes").len(), "positions16": list("meshes").iter().filter(small).count(),
        "error": cost.ceiling, "measured": cost.worst.distance, "time": cost.worst.time, "moments": cost.moments,
        "limit": limit, "normals": turned(&import.asset.character, changed),
    })
}

/// The largest angle between a normal and what became of it, degrees.
fn turned(from: &Character, to: &Character) -> f64 {
    let meshes = from.instances().iter().zip(to.instances()).map(|(a, b)| (from.mesh(a), to.mesh(b)));
    let normals = meshes.flat_map(|(a, b)| a.normals.iter().zip(&b.normals));
    let angles = normals.map(|(a, b)| a.as_dvec3().angle_between(b.as_dvec3()).to_degrees());
    angles.fold(0.0, f64::max)
}
