"""An environment of Gymnasium with a random policy. Needs gymnasium (`pip install "endowire[gym]"`)."""

import gymnasium

import endowire.gym  # registers endowire/…

environment = gymnasium.make("endowire/CurvedTube-v0", max_episode_steps=50)
environment.action_space.seed(1)
for episode in range(2):
    observation, info = environment.reset(seed=episode)
    total, over = 0.0, False
    while not over:
        action = environment.action_space.sample()  # a push and a turn, fractions of the largest speeds
        observation, reward, terminated, truncated, info = environment.step(action)
        total, over = total + float(reward), terminated or truncated
    shapes = {name: part.shape for name, part in observation.items()}
    print(
        f"episode {episode}: {info['steps']} steps, reward {total:.3f}, reached: {info['reached']}, "
        f"{info['way_mm']:.0f} mm left, {info['largest_wall_force_n']:.3f} N at most; {shapes}"
    )
environment.close()
