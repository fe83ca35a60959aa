"use strict";

// Dumbbells in a drum or on the plane: lengths are mm, y along the drum, z up.

class DumbbellStage extends Stage {
  build(film) {
    this.wall(film.wall);
  }

  place(film, k) {
    const { count } = film;
    this.dumbbells(film.sizes, film.centres.subarray(6 * k * count, 6 * (k + 1) * count),
      film.roles.subarray(k * count, (k + 1) * count));
    this.turn(film.spin * film.times[k]);
  }

  // sizes: {length, ball, rod} in mm.  centres: six numbers a dumbbell; NaN: not there.
  // roles: what each is coloured as, see the style sheet's --role-0 and following.
  dumbbells(sizes, centres, roles) {
    this.last.dumbbells = [sizes, centres, roles];
    if (!this.works) return;
    const count = roles.length, key = JSON.stringify([sizes, count]);
    if (this.built !== key) {
      const plain = () => new THREE.MeshStandardMaterial({ roughness: 0.5, metalness: 0 });
      this.balls = this.swarm("balls", new THREE.SphereGeometry(sizes.ball, 40, 26), plain(), 2 * count);
      this.rods = this.swarm("rods", new THREE.CylinderGeometry(sizes.rod, sizes.rod, 1, 32), plain(), count);
      this.built = key;
    }
    const tones = [0, 1, 2, 3, 4].map((k) => this.colour(`role-${k}`));
    const place = new THREE.Object3D(), up = new THREE.Vector3(0, 1, 0);
    for (let k = 0; k < count; k++) {
      const [one, two] = [0, 3].map((at) => new THREE.Vector3().fromArray(centres, 6 * k + at));
      const here = Number.isNaN(one.x) ? 0 : 1; // those that left shrink to nothing
      const axis = two.clone().sub(one), long = here ? axis.length() : 1;
      place.quaternion.identity();
      for (const [side, ball] of [one, two].entries()) {
        place.position.copy(here ? ball : up);
        place.scale.setScalar(here);
        place.updateMatrix();
        this.balls.setMatrixAt(2 * k + side, place.matrix);
        this.balls.setColorAt(2 * k + side, tones[roles[k]]);
      }
      if (here) {
        place.position.copy(one).addScaledVector(axis, 0.5);
        place.quaternion.setFromUnitVectors(up, axis.divideScalar(long));
      }
      place.scale.set(here, here * long, here);
      place.updateMatrix();
      this.rods.setMatrixAt(k, place.matrix);
      this.rods.setColorAt(k, tones[roles[k]]);
    }
    for (const mesh of [this.balls, this.rods]) {
      mesh.instanceMatrix.needsUpdate = true;
      mesh.instanceColor.needsUpdate = true;
    }
    this.ask();
  }

  // wall: {radius (null: flat), depth, across: [least, greatest], along: [least, greatest]}.
  wall(wall, spacing = 10) {
    const key = JSON.stringify([wall, spacing, this.style("wall")]);
    if (!this.works || key === this.walled) return;
    this.walled = key;
    this.last.wall = [wall, spacing];
    const at = (u, y, lift = 0) => wall.radius === null ? [u, y, lift - wall.depth]
      : [(wall.radius - lift) * Math.sin(u), y, (lift - wall.radius) * Math.cos(u)];
    const steps = wall.radius === null ? 1 : 48;
    const spread = ([low, high], n) => Array.from({ length: n + 1 }, (_, k) => low + ((high - low) * k) / n);
    const places = spread(wall.across, steps), corners = [], faces = [];
    places.forEach((u, k) => {
      corners.push(...at(u, wall.along[0]), ...at(u, wall.along[1]));
      if (k) faces.push(2 * k - 2, 2 * k, 2 * k - 1, 2 * k - 1, 2 * k, 2 * k + 1);
    });
    const geometry = new THREE.BufferGeometry().setIndex(faces);
    geometry.setAttribute("position", new THREE.Float32BufferAttribute(corners, 3));
    geometry.computeVertexNormals();
    const paint = { color: this.colour("wall"), roughness: 1, side: THREE.DoubleSide };
    this.put("wall", new THREE.Mesh(geometry, new THREE.MeshStandardMaterial(paint)));
    // Lines every 10 mm: along the drum they turn with it, around it they stay.
    this.pitch = wall.radius === null ? spacing : spacing / wall.radius;
    // Multiples of a unit, shifted by a phase, in a closed interval.
    const multiples = ([low, high], unit, phase = 0) => {
      const first = Math.ceil((low - phase) / unit), last = Math.floor((high - phase) / unit);
      return Array.from({ length: Math.max(0, last - first + 1) }, (_, k) => (first + k) * unit + phase);
    };
    const lift = 0.02;
    this.meridians = () => this.lines("meridians", multiples(wall.across, this.pitch, this.phase ?? 0)
      .flatMap((u) => [...at(u, wall.along[0], lift), ...at(u, wall.along[1], lift)]));
    this.meridians();
    this.lines("parallels", multiples(wall.along, spacing).flatMap((y) =>
      places.slice(1).flatMap((u, k) => [...at(places[k], y, lift), ...at(u, y, lift)])));
    this.axes(["x", wall.radius === null ? "y" : "η", "z"], at(wall.across[0], wall.along[0], lift), 10);
  }

  // Turn the drum by an angle (rad); only the lines show it, so whole spacings do not count.
  turn(angle) {
    if (!this.meridians || angle % this.pitch === this.phase) return;
    this.phase = angle % this.pitch;
    this.meridians();
  }
}
