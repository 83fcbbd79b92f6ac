//! Promises checked on third-party files, found in `SINEW_DATA` or `../shared/data`.
//!
//! Without the files every test here is reported as ignored, as is a test whose tool is missing (under `CI` both fail); with `SINEW_DATA` set to a missing folder the run fails.

mod bake;
mod bvh;
mod farm;
mod gltf_mutations;
mod gltf_oracle;
mod images;
mod invalid;
mod notes;
mod rays;
#[path = "../../src/test_rng.rs"]
mod rng;
mod scenes;
mod sha256;
mod support;
mod xzx;

use libtest_mimic::{Arguments, Trial};

fn main() {
    let data = support::data_dir();
    let mut trials: Vec<Trial> = Vec::new();
    for (name, test) in TESTS {
        let dir = data.clone();
        let run = move || test(dir.as_deref().expect("ignored without data")).map_err(Into::into);
        trials.push(Trial::test(*name, run).with_ignored_flag(data.is_none()));
    }
    trials.push(
        Trial::test("four_shards_by_gnu_parallel_are_the_whole", || farm::run().map_err(Into::into))
            .with_ignored_flag(!farm::possible()),
    );
    libtest_mimic::run(&Arguments::from_args(), trials).exit();
}

type Test = fn(&std::path::Path) -> Result<(), String>;

/// Name and body of every test.
const TESTS: &[(&str, Test)] = &[
    ("gltf_agrees_with_the_oracle", gltf_oracle::run),
    ("captures_agree_with_the_oracle", bvh::run),
    ("baked_clips_keep_their_bounds_and_are_small", bake::run),
    ("angles_and_back_on_every_animated_file", xzx::run),
    ("notes::the_robot_arm_is_where_it_should_be", notes::the_robot_arm_is_where_it_should_be),
    ("notes::closest_segments_rebuild_the_arms_weights", notes::closest_segments_rebuild_the_arms_weights),
    ("notes::rest_is_the_identity", notes::rest_is_the_identity),
    ("notes::surfaces_are_counted", notes::surfaces_are_counted),
    ("notes::cut_rigs_are_refused", notes::cut_rigs_are_refused),
    ("notes::pixels_move_as_in_the_notes", images::pixels_move_as_in_the_notes),
    ("notes::grays_are_those_of_the_notes", images::grays_are_those_of_the_notes),
    ("notes::the_mosaic_is_that_of_the_notes", images::the_mosaic_is_that_of_the_notes),
    ("notes::hues_are_those_of_the_notes", images::hues_are_those_of_the_notes),
    ("notes::layers_are_composited_as_in_the_notes", images::layers_are_composited_as_in_the_notes),
    ("notes::cast_rays_meet_what_they_do_in_the_notes", rays::cast_rays_meet_what_they_do_in_the_notes),
    ("notes::traced_rays_bring_the_light_of_the_notes", rays::traced_rays_bring_the_light_of_the_notes),
    ("notes::every_scene_is_drawn", scenes::every_scene_is_drawn),
    ("changed_bytes_never_panic", gltf_mutations::run),
    ("broken_files_are_refused_politely", invalid::run),
    ("the_program_survives_broken_files", invalid::program),
];
