//! Feet that walk: where they are and how they roll, on ground that runs backwards at a constant speed.

use super::motion::ease;
use glam::{DQuat, DVec3};

/// One foot's cycle. Phase 0 is when it touches down.
pub struct Foot {
    /// Share of the cycle on the ground.
    pub stance: f64,
    /// Half of the way that the ground runs while the foot stands, metres.
    pub reach: f64,
    /// Middle of that way, forward of rest, metres.
    pub forward: f64,
    /// How high the foot is carried, metres.
    pub lift: f64,
    /// Toes up at touch-down, degrees.
    pub strike_deg: f64,
    /// Heel up at take-off, degrees.
    pub push_deg: f64,
    /// Heel and ball of the foot, below and around the ankle at rest.
    pub heel: DVec3,
    pub ball: DVec3,
}

/// Where the foot is.
pub struct Step {
    /// Displacement of the ankle from rest.
    pub ankle: DVec3,
    /// Turn of the foot: positive is heel up, degrees about x.
    pub pitch_deg: f64,
    /// Turn of the toes against the foot, degrees about x: they stay on the ground.
    pub toes_deg: f64,
}

impl Foot {
    pub fn at(&self, phase: f64) -> Step {
        let phase = phase.rem_euclid(1.0);
        let s = self.stance;
        if phase < s {
            let u = phase / s;
            let down = 1.0 - ease(u / 0.25);
            let up = ease((u - 0.5) / 0.5);
            self.step(
                self.forward + self.reach * (1.0 - 2.0 * u),
                0.0,
                -self.strike_deg * down + self.push_deg * up,
                up,
            )
        } else {
            // A cubic from take-off to touch-down that leaves and arrives at the ground's speed.
            let u = (phase - s) / (1.0 - s);
            let slope = -2.0 * self.reach / s * (1.0 - s);
            let (u2, u3) = (u * u, u * u * u);
            let z = -self.reach * (2.0 * u3 - 3.0 * u2 + 1.0)
                + slope * (u3 - 2.0 * u2 + u)
                + self.reach * (3.0 * u2 - 2.0 * u3)
                + slope * (u3 - u2);
            let rise = self.lift * (std::f64::consts::PI * u).sin().powi(2) * (1.4 - 0.8 * u);
            let pitch = self.push_deg + (-self.strike_deg - self.push_deg) * ease(u / 0.9);
            self.step(self.forward + z, rise, pitch, 1.0 - ease(u / 0.3))
        }
    }

    /// The foot rolls over its heel while toes are up, over its ball while the heel is.
    fn step(&self, z: f64, rise: f64, pitch_deg: f64, toes: f64) -> Step {
        let turn = DQuat::from_rotation_x(pitch_deg.to_radians());
        let pivot = if pitch_deg > 0.0 { self.ball } else { self.heel };
        let ankle = pivot - turn * pivot + DVec3::new(0.0, rise, z);
        Step { ankle, pitch_deg, toes_deg: -pitch_deg.max(0.0) * toes }
    }
}
