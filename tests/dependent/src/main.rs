//! Renders a sphere under a lamp into a picture and checks its brightness.

use octolux::scene::{Camera, FilmSize, Fov, Material, Scene, Sphere, Surface};
use octolux::{RenderOptions, render};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let camera = Camera::new([0.0, 1.0, 4.0], [0.0; 3], Fov::X(40.0));
    let mut scene = Scene::builder(camera, FilmSize { width: 48, height: 32 });
    let grey = scene.material(Material::diffuse("grey", [0.5; 3]));
    scene.sphere(Sphere::new([0.0; 3], 1.0, Surface::Material(grey)));
    scene.sphere(Sphere::new([2.0, 4.0, 2.0], 0.5, Surface::emission([9.0; 3])));
    let picture = render(&scene.build()?, &RenderOptions { spp: 16, ..Default::default() })?;
    octolux::film::write_picture("dependent.exr".as_ref(), &picture, &Default::default())?;
    let brightest = picture.pixels.iter().flatten().copied().fold(0.0, f32::max);
    // The lamp of radiance 9 and radius 0.5 is sqrt(24) from the sphere's centre: where the sphere is nearest to it and faces it, a
    // surface of albedo 0.5 reflects 0.5 x 9 x (0.5 / (sqrt(24) - 1))^2 = 0.074. The brightest of noisy pixels is a little above that.
    assert!(brightest > 0.06 && brightest < 0.1, "{brightest}");
    println!("{} x {} pixels, the brightest {brightest}", picture.width, picture.height);
    Ok(())
}
