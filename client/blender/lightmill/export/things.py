"""What Blender says of one object: its materials, its particle, what it is known by."""


def holds_out(thing, view_layer):
    return thing.is_holdout or bool(thing.original.holdout_get(view_layer=view_layer))


def identity(thing):
    """What a piece of evaluated geometry is known by in later exports."""
    original = thing.original
    library = original.library.filepath if original.library else ""
    return (library, original.name, thing.data.name if thing.data else "")


def particle_of(instance, scene):
    """What Particle Info says of an instance, by its outputs; {} if it is no particle's."""
    system = instance.particle_system if instance.is_instance else None
    number = instance.persistent_id[0]
    if system is None or not 0 <= number < len(system.particles):
        return {}
    particle = system.particles[number]
    age = scene.frame_current + scene.frame_subframe - particle.birth_time
    return {"Index": number, "Age": age, "Lifetime": particle.lifetime, "Size": particle.size,
            "Location": tuple(particle.location), "Velocity": tuple(particle.velocity),
            "Angular Velocity": tuple(particle.angular_velocity)}


def materials_of(thing):
    """The materials of a geometry's slots. A slot counts before the geometry's own, which may have more."""
    own = list(thing.data.materials)
    slots = [slot.material for slot in thing.material_slots]
    return [m or (own[i] if i < len(own) else None) for i, m in enumerate(slots)] + own[len(slots):]
