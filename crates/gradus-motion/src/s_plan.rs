//! A plan of an S-shaped ramp: stages of constant jerk, from the present speed and acceleration to rest or for ever.
//!
//! Units are microsteps and ticks, in `f64`.

/// Steps of a bisection: all bits of an `f64`, and some.
const BISECTIONS: u32 = 60;

/// Most stages of a plan: five to turn round (a start is one), four to top speed, a cruise and four to rest.
const MAX_STAGES: usize = 14;

/// Where an axis is on its way, how fast it goes, and how fast that changes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Motion {
    pub(crate) position: f64,
    pub(crate) speed: f64,
    pub(crate) acceleration: f64,
}

impl Motion {
    pub(crate) fn after(self, Segment { jerk, time }: Segment) -> Self {
        let Self { position, speed, acceleration } = self;
        Self {
            position: position + time * (speed + time * (acceleration / 2.0 + time * jerk / 6.0)),
            speed: speed + time * (acceleration + time * jerk / 2.0),
            acceleration: acceleration + time * jerk,
        }
    }

    pub(crate) fn reversed(self) -> Self {
        Self { position: -self.position, speed: -self.speed, acceleration: -self.acceleration }
    }
}

/// A time of constant jerk.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Segment {
    pub(crate) jerk: f64,
    pub(crate) time: f64,
}

impl Segment {
    pub(crate) fn new(jerk: f64, time: f64) -> Self {
        Self { jerk, time }
    }

    pub(crate) fn reversed(self) -> Self {
        Self { jerk: -self.jerk, ..self }
    }
}

/// A segment of a plan, and the speed and acceleration at its end. They may differ from those that the segment leads
/// to: motion starts and ends with a step of speed if there is a start or stop speed.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Stage {
    pub(crate) segment: Segment,
    pub(crate) speed: f64,
    pub(crate) acceleration: f64,
}

/// What an axis is going to do, from now to rest, or for ever.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Plan {
    stages: [Stage; MAX_STAGES],
    length: usize,
    /// At the end of the last stage.
    pub(crate) end: Motion,
}

impl Plan {
    pub(crate) fn new(speed: f64, acceleration: f64) -> Self {
        Self { end: Motion { position: 0.0, speed, acceleration }, ..Self::default() }
    }

    /// Stage number `index`; the end of the plan is where there is none.
    pub(crate) fn stage(&self, index: usize) -> Option<&Stage> {
        self.stages.get(..self.length)?.get(index)
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.length == 0
    }

    pub(crate) fn push(&mut self, segment: Segment) {
        if let Some(stage) = self.stages.get_mut(self.length) {
            self.end = self.end.after(segment);
            *stage = Stage { segment, speed: self.end.speed, acceleration: self.end.acceleration };
            self.length += 1;
        }
    }

    /// Lets the last stage end with constant `speed`.
    pub(crate) fn settle(&mut self, speed: f64) {
        self.end_with(speed, 0.0);
    }

    pub(crate) fn end_with(&mut self, speed: f64, acceleration: f64) {
        self.end = Motion { speed, acceleration, ..self.end };
        if let Some(stage) = self.length.checked_sub(1).and_then(|last| self.stages.get_mut(last)) {
            *stage = Stage { speed, acceleration, ..*stage };
        }
    }

    /// Adds a way that ends at rest.
    pub(crate) fn rest(&mut self, way: [Segment; 4]) {
        way.into_iter().for_each(|segment| self.push(segment));
        self.settle(0.0);
    }

    /// Adds segments as long as `fits` holds for the end; returns whether it holds for all.
    pub(crate) fn follow_while(&mut self, segments: [Segment; 4], fits: impl Fn(Motion) -> bool) -> bool {
        for segment in segments {
            let part = |time| Segment { time, ..segment };
            if !fits(self.end.after(segment)) {
                self.push(part(largest(segment.time, |time| fits(self.end.after(part(time))))));
                return false;
            }
            self.push(segment);
        }
        true
    }

    pub(crate) fn reversed(mut self) -> Self {
        for stage in &mut self.stages {
            *stage =
                Stage { segment: stage.segment.reversed(), speed: -stage.speed, acceleration: -stage.acceleration };
        }
        Self { end: self.end.reversed(), ..self }
    }
}

/// Largest number in `0..=most` that fits, to the last bit, where `most` does not.
pub(crate) fn largest(most: f64, fits: impl Fn(f64) -> bool) -> f64 {
    let (mut low, mut high) = (0.0, most);
    for _ in 0..BISECTIONS {
        let middle = (low + high) / 2.0;
        if fits(middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
    low
}
