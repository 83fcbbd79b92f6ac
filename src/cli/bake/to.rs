//! Which form the result has: glTF with quaternions, or a rig of ours with angles.

use crate::cli::Failure;
use sinew::bake::{self, BakeDesc, BakeError, Baked, Watch, xzx};
use sinew::character::Character;
use sinew::clip::{Clip, Target};
use std::path::Path;

#[derive(clap::Args)]
pub(super) struct To {
    /// How rotations are written: quaternions, or XZX angles about each bone, which .json rigs alone can hold. By default what the
    /// output's name stands for.
    #[arg(long, value_name = "xzx|quat", value_parser = form)]
    to: Option<Form>,
}

#[derive(Clone, Copy, PartialEq)]
pub(super) enum Form {
    Xzx,
    Quat,
}

fn form(text: &str) -> Result<Form, String> {
    match text {
        "xzx" => Ok(Form::Xzx),
        "quat" => Ok(Form::Quat),
        _ => Err("expected xzx or quat".into()),
    }
}

/// Whether a file of this name is a rig of ours.
pub(super) fn is_rig(output: &Path) -> bool {
    output.extension().is_some_and(|e| e.eq_ignore_ascii_case("json"))
}

impl To {
    pub fn form(&self, output: &Path) -> Result<Form, Failure> {
        match (self.to, is_rig(output)) {
            (Some(Form::Xzx), false) => {
                let name = output.display();
                let packed = output.extension().is_some_and(|e| e.eq_ignore_ascii_case("sinew"));
                let what = if packed { "a file of packed clips" } else { "glTF" };
                Err(Failure::Usage(format!(
                    "--to xzx -o {name}: {what} has no place for angles; name a .json"
                )))
            }
            (Some(form), _) => Ok(form),
            (None, rig) => Ok(if rig { Form::Xzx } else { Form::Quat }),
        }
    }
}

/// Bake into a form; a clip that has it already is only baked.
pub(super) fn bake(
    form: Form,
    character: &Character,
    clip: &Clip,
    desc: &BakeDesc,
    watch: Watch,
) -> Result<Baked, BakeError> {
    let has = |of: fn(&Target) -> bool| clip.tracks.iter().any(|t| of(&t.target));
    match form {
        Form::Xzx if has(|t| matches!(t, Target::Rotation(_))) => {
            xzx::convert(character, clip, desc, xzx::Form::Angles, watch)
        }
        Form::Quat if has(|t| matches!(t, Target::Xzx(_))) => {
            xzx::convert(character, clip, desc, xzx::Form::Quaternions, watch)
        }
        _ => bake::bake_watched(character, clip, desc, watch),
    }
}
