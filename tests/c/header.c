/* The header is C99, and its calls need no C++: two fingers squeeze a disc and carry 1 N. */

#include <graspforce.h>

#include <math.h>
#include <stdio.h>
#include <string.h>

int main(void) {
    const double positions[] = {-1, 0, 1, 0}, normals[] = {1, 0, -1, 0}, limits[] = {4, 4};
    const double external_wrench[] = {0, -1, 0};
    double forces[4];
    char message[128];
    gf_contacts contacts;
    gf_solution solution;
    gf_quality quality;
    gf_grasp *grasp = NULL;
    gf_distributor *fingers = NULL;

    gf_contacts_init(&contacts, sizeof contacts);
    gf_solution_init(&solution, sizeof solution);
    gf_quality_init(&quality, sizeof quality);
    contacts.count = 2;
    contacts.dim = 2;
    contacts.positions = positions;
    contacts.normals = normals;
    contacts.max_normal_force = limits;
    if (gf_grasp_create(&contacts, NULL, &grasp, message, sizeof message) != GF_STATUS_SOLVED ||
        gf_grasp_quality(grasp, NULL, &quality, message, sizeof message) != GF_STATUS_SOLVED ||
        gf_distributor_create(grasp, NULL, &fingers, message, sizeof message) != GF_STATUS_SOLVED ||
        gf_distributor_solve(fingers, external_wrench, 3, forces, 4, &solution, message, sizeof message) !=
            GF_STATUS_SOLVED) {
        puts(message);
        return 1;
    }
    printf("graspforce %s: sigma %.9f, forces [%.9f %.9f] [%.9f %.9f], epsilon %.9f\n", gf_version(), solution.sigma,
           forces[0], forces[1], forces[2], forces[3], quality.epsilon);
    gf_distributor_destroy(fingers);
    gf_grasp_destroy(grasp);
    return strcmp(message, "") == 0 && fabs(solution.sigma - 0.25) < 1e-9 && fabs(forces[0] - 1.0) < 1e-9 &&
                   quality.closure == GF_CLOSURE_FORCE
               ? 0
               : 1;
}
