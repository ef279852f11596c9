"""A table on four feet, one more than it needs: all force distributions that hold it; with feet that
give a little, the one distribution, a proof of it, and how it changes when the load moves."""

import numpy as np

import perp

feet = np.array([[1.0, 0.5], [1.0, -0.5], [-1.0, 0.5], [-1.0, -0.5]])
weight, load = 100.0, np.array([0.3, 0.1])

# the feet's forces f >= 0 balance the load, G f = weight (1, load); rigid feet that press do not
# move, feet that lift off do not press: 0 <= f  perp  G'(G f - weight (1, load)) >= 0
G = np.vstack([np.ones(4), feet.T])
M, q = G.T @ G, -weight * G.T @ np.append(1.0, load)

for solution in perp.lcp_all(M, q):
    print(f"rigid feet: a family of dimension {solution.dimension}, between the forces")
    for forces in solution.vertices:
        print("   ", np.round(forces, 6) + 0.0)

M = M + 0.01 * np.eye(4)
r = perp.lcp(M, q)
proof = perp.lcp_verify(M, q, r.z)
print("soft feet:", np.round(r.z, 6), "proved" if proof else proof.reason)
print(f"    a true solution lies within {proof.radius:.0e}")

slope = perp.lcp_sensitivity(M, q, r.z)
dq = -weight * G.T @ [0.0, 0.01, 0.0]  # the load moves by 0.01 along the table
print("    change with the load:", np.round(slope.forward(dq), 6))
