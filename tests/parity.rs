use servobee::evaluate::problem::*;
use servobee::evaluate::*;
use servobee::model::valve::*;
use servobee::model::*;
#[test]
fn quick() {
    let s = Structure::actuator(10.0, "V");
    let p = s.parameters();
    let rate = s.fastest_rate(&p);
    let n = 1000;
    let time: Vec<f64> = (0..n).map(|k| k as f64 * 1e-3).collect();
    let samples = (0..n)
        .map(|k| Sample {
            input: [9.0 * ((k / 100) as f64 * 1.7).sin(), 0., 0., 0., 0.],
            target: [k as f64 * 0.001, 0., 0.],
            weight: 1.0,
            ..Default::default()
        })
        .collect();
    let mut series = Series {
        name: "x".into(),
        time,
        samples,
    };
    series.set_steps(rate, 1);
    let problem = Problem::new(s, p, Data::Series(vec![series]));
    println!("{}", wgsl::compose(&problem));
    println!("steps {}", problem.steps());
    let mut pop = Population::new(3);
    for i in 0..16384 {
        let f = i as f64 / 16384.0;
        let q: Vec<f64> = problem
            .free()
            .iter()
            .enumerate()
            .map(|(j, p)| p.from_unit((f * (7.0 + 10.0 * j as f64)).fract()))
            .collect();
        pop.push(&q);
    }
    let adapters = gpu::adapters();
    for a in &adapters {
        println!("{}", gpu::describe(&a.get_info()));
    }
    let mut g = gpu::GpuEvaluator::new(gpu::best(&adapters).unwrap(), gpu::Checks::Off).unwrap();
    let mut c32 = CpuEvaluator::new(Precision::F32);
    let mut c64 = CpuEvaluator::new(Precision::F64);
    g.costs(&problem, &pop).unwrap();
    let t = std::time::Instant::now();
    let a = g.costs(&problem, &pop).unwrap();
    let tg = t.elapsed();
    let t = std::time::Instant::now();
    let b = c32.costs(&problem, &pop).unwrap();
    let t32 = t.elapsed();
    let t = std::time::Instant::now();
    let c = c64.costs(&problem, &pop).unwrap();
    let t64 = t.elapsed();
    let m = problem.steps() as f64 * pop.len() as f64 / 1e6;
    println!(
        "gpu {:.0} f32 {:.0} f64 {:.0} M/s  ({tg:?})",
        m / tg.as_secs_f64(),
        m / t32.as_secs_f64(),
        m / t64.as_secs_f64()
    );
    let mut e = [0.0f64; 2];
    for i in 0..pop.len() {
        e[0] = e[0].max((a[i].value / b[i].value - 1.0).abs());
        e[1] = e[1].max((a[i].value / c[i].value - 1.0).abs());
    }
    println!("{e:?} {:?} {:?} {:?}", a[5], b[5], c[5]);
    let _ = ValveForm::linear();
}
