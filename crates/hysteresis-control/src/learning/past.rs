//! What a filter remembers.

/// The last so many samples, each stored twice so that any window of them is one slice.
#[derive(Clone, Debug)]
pub(super) struct Past {
    samples: Box<[f64]>,
    next: usize,
}

impl Past {
    pub(super) fn new(length: usize) -> Self {
        Self { samples: vec![0.0; 2 * length].into(), next: 0 }
    }

    pub(super) fn length(&self) -> usize {
        self.samples.len() / 2
    }

    pub(super) fn push(&mut self, sample: f64) {
        let length = self.length();
        for index in [self.next, self.next + length] {
            if let Some(entry) = self.samples.get_mut(index) {
                *entry = sample;
            }
        }
        self.next = if self.next + 1 == length { 0 } else { self.next + 1 };
    }

    /// `count` samples, oldest first, the first of them `first` samples before the one to come.
    pub(super) fn window(&self, first: usize, count: usize) -> &[f64] {
        let start = self.next + self.length() - first;
        self.samples.get(start..start + count).unwrap_or_default()
    }

    /// The sample that came `steps` before the one to come.
    pub(super) fn before(&self, steps: usize) -> f64 {
        self.window(steps, 1).first().copied().unwrap_or_default()
    }

    pub(super) fn clear(&mut self) {
        self.samples.fill(0.0);
        self.next = 0;
    }

    /// All samples, the oldest first.
    pub(super) fn oldest_first(&self) -> &[f64] {
        self.window(self.length(), self.length())
    }

    /// Goes on from as many samples, the oldest first.
    pub(super) fn restore(&mut self, samples: &[f64]) {
        let (first, second) = self.samples.split_at_mut(samples.len());
        first.copy_from_slice(samples);
        second.copy_from_slice(samples);
        self.next = 0;
    }
}
