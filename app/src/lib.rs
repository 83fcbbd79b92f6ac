//! The timeline editor: pose a character, set keys, shape curves, export. Interface only; what is done to a character is a call to
//! [`sinew`].
//!
//! [`state`] is plain data, changed by [`State::update`](state::State::update) alone; [`commands`] names every action once;
//! [`panels`] draw the state and send commands, and never change it; [`viewport`] draws the character; [`jobs`] reads and
//! writes files beside the window. [`App`] holds them together and needs no window, so tests drive it.

pub mod commands;
pub mod jobs;
pub mod layout;
pub mod paint;
pub mod panels;
pub mod screenshot;
pub mod state;
pub mod viewport;

mod app;

pub use app::{App, Bus, set_up};
