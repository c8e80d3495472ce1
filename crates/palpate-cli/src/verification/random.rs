//! Numbers that look random and are the same in every run: Marsaglia's xorshift.

use glam::DVec3;

/// A sequence that follows from its seed, which must not be 0.
pub struct Random(pub u64);

impl Random {
    /// Another sequence for every pair of numbers (the finaliser of splitmix64).
    pub fn of(first: u64, second: u64) -> Self {
        let mut seed = (first << 32 | second).wrapping_add(0x9e37_79b9_7f4a_7c15);
        seed = (seed ^ seed >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        seed = (seed ^ seed >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        Self((seed ^ seed >> 31).max(1))
    }

    /// At least 0, below 1.
    pub fn unit(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Between two numbers.
    pub fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// Whether something of this probability happens.
    pub fn chance(&mut self, probability: f64) -> bool {
        self.unit() < probability
    }

    /// One of several.
    pub fn one_of<T: Copy, const N: usize>(&mut self, of: [T; N]) -> T {
        of[(self.unit() * N as f64) as usize]
    }

    /// A point of the cube from −1 to 1.
    pub fn vector(&mut self) -> DVec3 {
        DVec3::new(self.within(-1.0, 1.0), self.within(-1.0, 1.0), self.within(-1.0, 1.0))
    }
}
