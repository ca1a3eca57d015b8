//! Time of every case. Criterion reports the time of a pass and the rate in elements (samples) per second.

use std::time::Duration;

use bench_report::cases::Case;
use bench_report::workload::Workload;
use criterion::{BenchmarkId, Criterion, SamplingMode, Throughput, criterion_group, criterion_main};

/// Different seconds of noise.
const SECONDS: u64 = 32;

fn time(criterion: &mut Criterion) {
    for case in Case::all() {
        let mut group = criterion.benchmark_group(case.signal.slug());
        group.throughput(Throughput::Elements(case.samples().into()));
        group.sampling_mode(SamplingMode::Flat);
        let id = BenchmarkId::new(case.kind(), case.operators);
        let mut workload = None; // made only if it is not filtered out
        group.bench_function(id, |bencher| {
            let workload = workload.get_or_insert_with(|| Workload::new(case, SECONDS));
            bencher.iter(|| workload.pass());
        });
    }
}

criterion_group! {
    name = benches;
    config = Criterion::default()
        .sample_size(30)
        .nresamples(2_000)
        .warm_up_time(Duration::from_millis(100))
        .measurement_time(Duration::from_secs(1));
    targets = time
}
criterion_main!(benches);
