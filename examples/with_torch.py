"""Use a model in a PyTorch loss: points move to the surface and spread over it."""

import torch

import mplicits

spot = mplicits.load("spot")
generator = torch.Generator().manual_seed(0)
points = torch.empty(200, 3).uniform_(-1, 1, generator=generator).requires_grad_()
optimizer = torch.optim.Adam([points], lr=0.05)
for _ in range(50):
    near = torch.cdist(points, points) + 10 * torch.eye(len(points))
    loss = spot(points).abs().mean() - 0.1 * near.min(dim=1).values.clamp(max=0.1).mean()
    optimizer.zero_grad()
    loss.backward()
    optimizer.step()
print(f"{spot(points).abs().mean():.4f} from the surface on average")
