// Answers the cases of a file of numbers, for comparison with those of the Python library.
//
// A case: dim count k, then for each contact position, normal, tangent, friction, limit, torsion, edges and the number
// of its extreme forces with their rows, then origin, length scale, friction margin, objective, weight, lower bounds
// (m numbers, or -1 for none); of least squares weights, references, and 1 with the slack or 0; then the number of
// wrenches and the wrenches. Printed are matrix, frames, for each wrench a status with forces, objective, gap and
// residual, or with the separating direction, then distance, forces and residual of the nearest wrench; and both
// qualities.

#include <graspforce.h>

#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <vector>

namespace {

char message[512];

std::vector<double> numbers(std::size_t count) {
    std::vector<double> values(count);
    for (double &value : values)
        if (!(std::cin >> value)) std::exit(3);
    return values;
}

std::size_t whole() { return static_cast<std::size_t>(numbers(1)[0]); }

void append(std::vector<double> &all, std::size_t count) {
    for (double value : numbers(count)) all.push_back(value);
}

void print(const double *values, std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) std::printf("%.17g ", values[i]);
}

void solved(gf_status status) {
    if (status == GF_STATUS_SOLVED) return;
    std::fprintf(stderr, "%s: %s\n", gf_status_name(status), message);
    std::exit(2);
}

void answer(std::size_t dim) {
    const std::size_t count = whole(), force_dim = whole(), wrench_dim = dim == 2 ? 3 : 6;
    std::vector<double> positions, normals, tangents, friction, limits, torsion, extreme;
    std::vector<std::uint32_t> edges, rows;
    for (std::size_t i = 0; i < count; ++i) {
        append(positions, dim);
        append(normals, dim);
        append(tangents, dim);
        append(friction, 1);
        append(limits, 1);
        append(torsion, 1);
        edges.push_back(static_cast<std::uint32_t>(whole()));
        rows.push_back(static_cast<std::uint32_t>(whole()));
        append(extreme, rows.back() * (dim == 2 ? 2 : 4));
    }
    gf_contacts contacts;
    gf_contacts_init(&contacts, sizeof contacts);
    contacts.count = count;
    contacts.dim = dim;
    contacts.positions = positions.data();
    contacts.normals = normals.data();
    contacts.tangents = dim == 2 ? nullptr : tangents.data();
    contacts.friction = friction.data();
    contacts.max_normal_force = limits.data();
    contacts.torsion = torsion.data();
    contacts.edges = edges.data();
    contacts.num_extreme_forces = rows.data();
    contacts.extreme_forces = extreme.data();
    gf_grasp_options grasp_options;
    gf_grasp_options_init(&grasp_options, sizeof grasp_options);
    const std::vector<double> origin = numbers(dim);
    for (std::size_t k = 0; k < dim; ++k) grasp_options.origin[k] = origin[k];
    grasp_options.length_scale = numbers(1)[0];
    grasp_options.friction_margin = numbers(1)[0];

    gf_grasp *grasp = nullptr;
    solved(gf_grasp_create(&contacts, &grasp_options, &grasp, message, sizeof message));
    if (gf_grasp_num_contacts(grasp) != count || gf_grasp_force_dim(grasp) != force_dim ||
        gf_grasp_wrench_dim(grasp) != wrench_dim)
        std::exit(4);
    std::vector<double> matrix(wrench_dim * count * force_dim), frames(count * dim * dim);
    solved(gf_grasp_matrix(grasp, matrix.data(), matrix.size(), message, sizeof message));
    solved(gf_grasp_frames(grasp, frames.data(), frames.size(), message, sizeof message));
    print(matrix.data(), matrix.size());
    print(frames.data(), frames.size());

    gf_distributor_options options;
    gf_distributor_options_init(&options, sizeof options);
    options.objective = static_cast<std::int32_t>(whole());
    options.weight = numbers(1)[0];
    const std::vector<double> bounds = numbers(count);
    if (bounds[0] >= 0.0) options.min_normal = bounds.data();
    std::vector<double> weights, reference, slack;
    if (options.objective == GF_OBJECTIVE_SQUARES) {
        weights = numbers(count);
        reference = numbers(count * force_dim);
        options.weights = weights.data();
        options.reference = reference.data();
        if (whole() == 1) {
            slack = numbers(wrench_dim * wrench_dim);
            options.slack = slack.data();
        }
    }
    gf_distributor *distributor = nullptr;
    solved(gf_distributor_create(grasp, &options, &distributor, message, sizeof message));
    gf_solution solution;
    gf_solution_init(&solution, sizeof solution);
    std::vector<double> forces(count * force_dim), again(forces.size()), wrench;
    for (std::size_t left = whole(); left > 0; --left) {
        wrench = numbers(wrench_dim);
        const gf_status status = gf_distributor_solve(distributor, wrench.data(), wrench_dim, forces.data(), forces.size(),
                                                      &solution, message, sizeof message);
        std::printf("%d ", status);
        if (status == GF_STATUS_SOLVED) {
            solved(gf_distributor_solve(distributor, wrench.data(), wrench_dim, again.data(), again.size(), nullptr,
                                        message, sizeof message));
            print(again.data(), again.size());
            print(forces.data(), forces.size());
            print(&solution.sigma, 1);
            print(&solution.gap, 1);
            print(solution.residual, wrench_dim);
        } else {
            print(solution.direction, wrench_dim);
        }
        double distance = 0.0;
        solved(gf_distributor_nearest(distributor, wrench.data(), wrench_dim, again.data(), again.size(), &distance, nullptr,
                                      message, sizeof message));
        print(&distance, 1);
        print(again.data(), again.size());
        solved(gf_distributor_nearest(distributor, wrench.data(), wrench_dim, forces.data(), forces.size(), nullptr,
                                      &solution, message, sizeof message));
        print(&solution.distance, 1);
        print(forces.data(), forces.size());
        print(solution.residual, wrench_dim);
    }

    gf_quality_options asked;
    gf_quality_options_init(&asked, sizeof asked);
    asked.external_wrench = wrench.data();
    gf_quality quality;
    gf_quality_init(&quality, sizeof quality);
    for (int criterion : {GF_CRITERION_MAX, GF_CRITERION_SUM}) {
        asked.criterion = criterion;
        const gf_status status = gf_grasp_quality(grasp, &asked, &quality, message, sizeof message);
        if (status != GF_STATUS_NOT_CONVERGED) solved(status);
        std::printf("%.17g %.17g %.17g %d ", quality.epsilon, quality.lower, quality.upper, quality.closure);
        print(quality.direction, wrench_dim);
    }
    std::printf("\n");
    gf_distributor_destroy(distributor);
    gf_grasp_destroy(grasp);
}

} // namespace

int main() {
    double dim;
    while (std::cin >> dim) answer(static_cast<std::size_t>(dim));
}
