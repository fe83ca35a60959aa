"use strict";

// Dumbbells, the wall and contacts, drawn with three.js (the global THREE).  One Stage is one
// picture, on pages of films and on the live page.
// Lengths are mm, coordinates those of the library: y along the drum, z up.

class Stage {
  // host: the element to fill.  Without WebGL it shows a message, and all methods do nothing.
  constructor(host) {
    this.host = host;
    this.scene = new THREE.Scene();
    this.camera = new THREE.PerspectiveCamera(32, 1, 1, 4000);
    this.radius = 30;
    this.phase = 0; // angle (rad) by which the lines along the drum have turned
    this.scene.add(this.camera);
    this.scene.add(new THREE.AmbientLight(0xffffff, 0.5));
    const lamp = new THREE.DirectionalLight(0xffffff, 0.6);
    lamp.position.set(-0.5, 0.8, 1);
    this.camera.add(lamp, lamp.target); // light comes over the observer's shoulder
    this.last = {};
    this.works = this.start();
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.repaint());
  }

  start() {
    // Without WebGL three.js would log an error.
    const probe = document.createElement("canvas");
    const context = probe.getContext("webgl2") || probe.getContext("webgl");
    if (!context) {
      this.host.textContent = "This browser cannot show three dimensions (no WebGL).";
      return false;
    }
    context.getExtension("WEBGL_lose_context")?.loseContext(); // browsers limit their number
    this.renderer = new THREE.WebGLRenderer({ antialias: true, alpha: true });
    this.renderer.outputEncoding = THREE.sRGBEncoding;
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.host.append(this.renderer.domElement);
    this.controls = new THREE.TrackballControls(this.camera, this.renderer.domElement);
    this.controls.staticMoving = true;
    this.controls.rotateSpeed = 2.5;
    this.controls.keys = ["", "", ""]; // no letters as shortcuts
    this.controls.addEventListener("change", () => this.ask());
    this.host.addEventListener("keydown", (event) => this.key(event));
    new ResizeObserver(() => this.resize()).observe(this.host);
    this.resize();
    this.view();
    const frame = () => {
      requestAnimationFrame(frame);
      this.controls.update(); // requests a frame if the view has changed
      if (this.asked) this.renderer.render(this.scene, this.camera);
      this.asked = false;
    };
    frame();
    return true;
  }

  ask() { this.asked = true; }

  resize() {
    const { clientWidth: width, clientHeight: height } = this.host;
    if (!width || !height) return;
    this.renderer.setSize(width, height);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.controls.handleResize();
    this.ask();
  }

  // ------------------------------------------------------------------------------------- the view

  // Look at a ball of some radius (mm) about a point, from a direction and with a direction that
  // points up the page; remembered for the button that resets the view.
  frame(centre, radius, from = [0, -0.55, 1], up = [0, 1, 0]) {
    Object.assign(this, { centre, radius, from, up });
    this.view();
  }

  view() {
    if (!this.renderer) return;
    const target = new THREE.Vector3(...(this.centre ?? [0, 0, 0]));
    const narrow = Math.min(1, this.camera.aspect);
    const far = this.radius / Math.sin((this.camera.fov * Math.PI) / 360) / narrow;
    this.controls.target.copy(target);
    this.camera.up.set(...(this.up ?? [0, 1, 0]));
    const from = new THREE.Vector3(...(this.from ?? [0, 0, 1])).normalize();
    this.camera.position.copy(target).addScaledVector(from, far);
    Object.assign(this.camera, { near: far / 100, far: 20 * far });
    this.camera.updateProjectionMatrix();
    this.camera.lookAt(target);
    this.ask();
  }

  // Move the camera and its target by a vector in mm.
  shift(by) {
    if (!this.renderer) return;
    for (const place of [this.camera.position, this.controls.target]) place.add(new THREE.Vector3(...by));
    this.ask();
  }

  // Keys of the picture in focus: arrows turn it, + and - zoom, 0 resets the view.
  key(event) {
    const turn = { ArrowLeft: [0, 1], ArrowRight: [0, -1], ArrowUp: [1, 1], ArrowDown: [1, -1] }[event.key];
    const zoom = { "+": 0.9, "-": 1 / 0.9 }[event.key];
    if (!turn && !zoom && event.key !== "0") return;
    event.preventDefault();
    event.stopPropagation();
    if (event.key === "0") return void this.view();
    const away = this.camera.position.clone().sub(this.controls.target);
    if (turn) {
      const side = this.camera.up.clone().cross(away).normalize();
      const rotation = new THREE.Quaternion();
      rotation.setFromAxisAngle(turn[0] ? side : this.camera.up.clone().normalize(), -0.12 * turn[1]);
      away.applyQuaternion(rotation);
      this.camera.up.applyQuaternion(rotation);
    }
    this.camera.position.copy(this.controls.target).add(away.multiplyScalar(zoom ?? 1));
    this.ask();
  }

  // --------------------------------------------------------------------------------- what is there

  style(name) {
    return getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
  }

  // A colour of the style sheet; three.js computes with linear light.
  colour(name) {
    return new THREE.Color(this.style(name)).convertSRGBToLinear();
  }

  // Build everything again after a change of the colour scheme.
  repaint() {
    for (const [method, given] of Object.entries(this.last)) this[method](...given);
  }

  // Add an object under a name, in place of the former one.
  put(name, object) {
    const old = this.scene.getObjectByName(name);
    if (old) {
      old.removeFromParent();
      old.traverse((part) => {
        part.geometry?.dispose();
        part.material?.map?.dispose();
        part.material?.dispose();
      });
    }
    if (object) {
      object.name = name;
      this.scene.add(object);
    }
    this.ask();
    return object;
  }

  swarm(name, geometry, material, count) {
    const mesh = new THREE.InstancedMesh(geometry, material, count);
    mesh.frustumCulled = false; // its box does not follow the instances
    return this.put(name, mesh);
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

  // points: an array of [x, y, z].  They shine through what is in front of them.
  contacts(points, size) {
    this.last.contacts = [points, size];
    if (!this.works) return;
    const place = new THREE.Object3D();
    for (const [name, scale, opacity] of [["halo", 0.3, 0.45], ["core", 0.14, 1]]) {
      if (!points.length) {
        this.put(name, null);
        continue;
      }
      const material = new THREE.MeshBasicMaterial({
        color: this.colour("glow"), transparent: true, opacity, depthTest: false, depthWrite: false,
      });
      const mesh = this.swarm(name, new THREE.SphereGeometry(scale * size, 20, 14), material, points.length);
      mesh.renderOrder = name === "core" ? 3 : 2;
      points.forEach((point, k) => {
        place.position.fromArray(point);
        place.updateMatrix();
        mesh.setMatrixAt(k, place.matrix);
      });
    }
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
    this.meridians = () => this.lines("meridians", multiples(wall.across, this.pitch, this.phase)
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

  lines(name, numbers) {
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.Float32BufferAttribute(numbers, 3));
    this.put(name, new THREE.LineSegments(geometry, new THREE.LineBasicMaterial({ color: this.colour("grid") })));
  }

  // Three arrows of a length (mm) from a point, with their names at the ends.
  axes(names, origin, length) {
    this.last.axes = [names, origin, length];
    if (!this.works) return;
    const group = new THREE.Group(), ends = [];
    names.forEach((name, k) => {
      const end = origin.map((value, j) => value + (j === k ? length : 0));
      ends.push(...origin, ...end);
      const sprite = this.letter(name);
      sprite.position.fromArray(end.map((value, j) => value + (j === k ? 0.22 * length : 0)));
      sprite.scale.setScalar(0.42 * length);
      group.add(sprite);
    });
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.Float32BufferAttribute(ends, 3));
    group.add(new THREE.LineSegments(geometry, new THREE.LineBasicMaterial({ color: this.colour("ink") })));
    this.put("axes", group);
  }

  letter(text) {
    const canvas = Object.assign(document.createElement("canvas"), { width: 96, height: 96 });
    const pen = canvas.getContext("2d");
    Object.assign(pen, { font: "italic 64px serif", textAlign: "center", textBaseline: "middle" });
    pen.fillStyle = this.style("ink");
    pen.fillText(text, 48, 48);
    const map = new THREE.CanvasTexture(canvas);
    map.encoding = THREE.sRGBEncoding;
    const sprite = new THREE.Sprite(new THREE.SpriteMaterial({ map, depthTest: false }));
    sprite.renderOrder = 1; // after a translucent solid, which would pale it
    return sprite;
  }

  // --------------------------------------------------------------------------------------- atlases

  // Show a GLB file (an ArrayBuffer) instead of the last one; resolves to its bounding box.
  model(buffer) {
    if (!this.works) return Promise.resolve(null);
    return new Promise((resolve, reject) => {
      new THREE.GLTFLoader().parse(buffer, "", (found) => {
        this.put("model", found.scene);
        const box = new THREE.Box3().setFromObject(found.scene);
        resolve({ low: box.min.toArray(), high: box.max.toArray() });
      }, reject);
    });
  }

  // Look at the box of an atlas with the relative heading upwards, from where the figures of the
  // solid are seen: elevation 22 degrees, azimuth -35 degrees.
  frameBox({ low, high }) {
    const middle = low.map((value, k) => (value + high[k]) / 2);
    const [elevation, azimuth] = [22, -35].map((degrees) => (degrees * Math.PI) / 180);
    const from = [Math.cos(azimuth), Math.sin(azimuth), Math.tan(elevation)];
    this.frame(middle, 0.5 * Math.hypot(...low.map((value, k) => high[k] - value)), from, [0, 0, 1]);
  }

  // A path through the atlas and its current point; pieces: arrays of [x, y, z].
  way(pieces, point, radius) {
    this.last.way = [pieces, point, radius];
    if (!this.works) return;
    const group = new THREE.Group();
    // Declared transparent, so that it is drawn last, over the solid.
    const seen = (name) => new THREE.MeshBasicMaterial({ color: this.colour(name), depthTest: false, transparent: true });
    for (const piece of pieces) {
      if (piece.length < 2) continue;
      const curve = new THREE.CatmullRomCurve3(piece.map((p) => new THREE.Vector3(...p)));
      const tube = new THREE.TubeGeometry(curve, Math.min(4 * piece.length, 800), 0.45 * radius, 8);
      group.add(new THREE.Mesh(tube, seen("way")));
    }
    const mark = new THREE.Mesh(new THREE.SphereGeometry(radius, 24, 16), seen("here"));
    mark.position.fromArray(point);
    group.add(mark);
    group.children.forEach((part, k) => { part.renderOrder = 2 + k; });
    this.put("way", group);
  }
}
