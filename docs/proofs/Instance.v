(* The hypotheses can be met, and no condition is idle: three places that hold two vehicles each, and three loops, A over
   the places 0 and 1, B over 1 and 2, C over 2 and 0. *)
Require Import Model Chain Crowd Service Way Ends Everyone Change.

Inductive stand := A0 | A1 | B1 | B2 | C2 | C0.
Definition at_place s := match s with A0 => 0 | A1 => 1 | B1 => 1 | B2 => 2 | C2 => 2 | C0 => 0 end.
Definition after s := match s with A0 => A1 | A1 => A0 | B1 => B2 | B2 => B1 | C2 => C0 | C0 => C2 end.
Lemma goes_elsewhere s : at_place (after s) <> at_place s. Proof. destruct s; discriminate. Qed.
#[global] Instance three : roads := {|
  spot := stand; place := at_place; next := after; slots := fun _ => 2; no_self := goes_elsewhere |}.

(* the hypotheses of the section of the theorem *)
Lemma three_wide : forall p, 2 <= slots p. Proof. intro. simpl. lia. Qed.
Lemma three_places : forall s, place s < 3. Proof. intros []; simpl; lia. Qed.
Lemma three_spots : forall s : spot, In s [A0; A1; B1; B2; C2; C0]. Proof. intros []; simpl; auto 10. Qed.
Definition three_eq : forall s t : spot, {s = t} + {s <> t}. Proof. simpl. decide equality. Defined.
Lemma three_closed : forall s, exists k, far (S k) s = s. Proof. intros []; exists 1; reflexivity. Qed.
Definition three_theorem := live_for_everyone three_wide 3 three_places _ three_spots three_eq three_closed.

Definition lines (a b c : list stand) : config := fun p => match p with 0 => a | 1 => b | 2 => c | _ => [] end.

Ltac is_possible := intros [|[|[|p]]]; split; simpl; try lia; intros s I; repeat destruct I as [<-|I]; try reflexivity; contradiction.

(* (S) where at most two vehicles are on each loop *)
Lemma two_on_each D nA nB nC : possible D -> nA <= 2 -> nB <= 2 -> nC <= 2 ->
  (forall f, (forall s : spot, f (next s) = f s) ->
    on_loops 3 f D = (if f A0 then nA else 0) + (if f B1 then nB else 0) + (if f C2 then nC else 0)) -> uncrowded D.
Proof.
  intros P HA HB HC On Q f ND St In_ (x & s & _ & [[k Ik] [j Oj]]).
  rewrite (residents_are_in 3 three_places Q f D P ND In_), (On f St).
  assert (Size : sum slots Q = 2 * length Q) by (clear; unfold sum; induction Q; simpl in *; lia).
  assert (Least : forall l, NoDup l -> incl l Q -> length l <= length Q) by (intros l Nl I; apply NoDup_incl_length; auto).
  assert (TA : f A0 = true -> In 0 Q /\ In 1 Q) by (intro T; split; [apply (In_ A0)|apply (In_ A1); change A1 with (next A0); rewrite St]; auto).
  assert (TB : f B1 = true -> In 1 Q /\ In 2 Q) by (intro T; split; [apply (In_ B1)|apply (In_ B2); change B2 with (next B1); rewrite St]; auto).
  assert (TC : f C2 = true -> In 2 Q /\ In 0 Q) by (intro T; split; [apply (In_ C2)|apply (In_ C0); change C0 with (next C2); rewrite St]; auto).
  assert (Not3 : ~ (In 0 Q /\ In 1 Q /\ In 2 Q)).
  { intros (I0 & I1 & I2). apply Oj. assert (L := three_places (far j s)). destruct (place (far j s)) as [|[|[|]]]; auto; lia. }
  assert (Two : forall a b, a <> b -> In a Q -> In b Q -> 2 <= length Q).
  { intros a b N Ia Ib. apply (Least [a; b]); [repeat constructor; simpl; intuition congruence|]. intros y [<-|[<-|[]]]; auto. }
  assert (One : 1 <= length Q) by (destruct Q; [destruct Ik|simpl; lia]).
  destruct (f A0), (f B1), (f C2); try (exfalso; tauto); try lia.
  - specialize (Two 0 1). assert (2 <= length Q) by (apply Two; [lia|tauto|tauto]). lia.
  - specialize (Two 1 2). assert (2 <= length Q) by (apply Two; [lia|tauto|tauto]). lia.
  - specialize (Two 2 0). assert (2 <= length Q) by (apply Two; [lia|tauto|tauto]). lia.
Qed.

Ltac counts := intros f St; assert (FA : f A1 = f A0) by apply (St A0); assert (FB : f B2 = f B1) by apply (St B1);
  assert (FC : f C0 = f C2) by apply (St C2); unfold on_loops, residents, sum, count; simpl; rewrite ?FA, ?FB, ?FC;
  destruct (f A0), (f B1), (f C2); reflexivity.

(* who follows heads over full places needs two full ones, the first's head wanting the second *)
Lemma first_step (D : config) p n : way D p (S n) p -> full D p /\ exists x, wants D p x /\ full D x.
Proof.
  intro W. split; [inversion W; auto|]. apply (goes_on D p (S n) p W 0); [lia|constructor].
Qed.

Ltac no_step := intros (p & n & W); apply first_step in W; destruct W as (F & x & (s & H & <-) & Fx);
  unfold full, head in *; destruct p as [|[|[|p]]]; simpl in *; try discriminate; injection H as <-; discriminate.

(* 1. A start with a full place, as many residents as (S) allows, and no circle: live. *)
Definition start := lines [A0] [A1; B1] [B2].
Lemma start_possible : possible start. Proof. is_possible. Qed.
Theorem start_is_live : live start /\ full start 1.
Proof.
  split; [|reflexivity]. apply (three_theorem _ start_possible). split; [no_step|].
  apply (two_on_each _ 2 2 0 start_possible); try lia. counts.
Qed.

(* 2. A circle, though (S) holds: not live. *)
Definition ring := lines [A0; A0] [B1; B1] [C2; C2].
Lemma ring_possible : possible ring. Proof. is_possible. Qed.
Theorem ring_is_dead : ~ live ring /\ uncrowded ring.
Proof.
  split; [|apply (two_on_each _ 2 2 2 ring_possible); try lia; counts].
  intro L. apply (three_theorem _ ring_possible) in L. apply L. exists 0, 2.
  assert (W : forall a b, ring a = b :: [b] -> wants ring a (place (next b))) by (intros a b E; exists b; unfold head; rewrite E; auto).
  apply (onto ring 0 2 2); [|apply (W 2 C2); reflexivity|reflexivity].
  apply (onto ring 0 1 1); [|apply (W 1 B1); reflexivity|reflexivity].
  apply (onto ring 0 0 0); [constructor|apply (W 0 A0); reflexivity|reflexivity].
Qed.

(* 3. Three residents in two places that another crosses, though there is no circle: not live. *)
Definition crowd := lines [A0; A0] [A1] [B2].
Lemma crowd_possible : possible crowd. Proof. is_possible. Qed.
Theorem crowd_is_dead : ~ live crowd /\ ~ circle crowd.
Proof.
  split; [|no_step]. intro L. apply (three_theorem _ crowd_possible) in L. destruct L as [_ U].
  assert (X : residents [0; 1] (fun s => match s with A0 | A1 => true | _ => false end) crowd + 2 <= sum slots [0; 1]).
  { apply U; [repeat constructor; simpl; intuition congruence|intros []; reflexivity|intros []; simpl; intro; auto; discriminate|].
    exists 2, B2. split; [left; reflexivity|]. split; [exists 1|exists 0]; simpl; [auto|intuition congruence]. }
  unfold residents, sum, count in X. simpl in X. lia.
Qed.

(* 4. The vehicle in place 2 gets another loop: everyone stays live. *)
Definition turned := lines [A0] [A1; B1] [C2].
Lemma turned_possible : possible turned. Proof. is_possible. Qed.
Theorem turned_is_live : live turned.
Proof.
  apply (change_of_path three_wide 3 three_places _ three_spots three_eq three_closed (fun p => p = 2) start turned).
  - apply start_possible.
  - apply start_is_live.
  - split; [apply turned_possible|]. intros [|[|[|p]]]; reflexivity.
  - intros p q N. destruct p as [|[|[|p]]]; try tauto; contradiction.
  - split; [|apply (two_on_each _ 2 1 1 turned_possible); try lia; counts].
    intros p n -> W. apply first_step in W. destruct W as [F _]. discriminate.
Qed.

(* 5. The head of place 2 stands for good, and nobody else's loop leads there: all others go on. *)
Definition broken := lines [A0] [A1] [B2; C2].
Lemma broken_possible : possible broken. Proof. is_possible. Qed.
Theorem others_go_on : live_but (Nat.eqb 2) broken.
Proof.
  apply (breakdown three_wide 3 three_places _ three_spots three_eq three_closed _ _ broken_possible). split; [|split].
  - intros p s k Bp I. assert (HA : s = A0 \/ s = A1).
    { destruct p as [|[|[|p]]]; simpl in *; try discriminate; repeat destruct I as [<-|I]; auto; contradiction. }
    assert (Stay : forall k s, s = A0 \/ s = A1 -> far k s = A0 \/ far k s = A1).
    { clear. induction k as [|k IH]; intros s H; auto. simpl. apply IH. destruct H as [-> | ->]; simpl; auto. }
    destruct (Stay k s HA) as [-> | ->]; reflexivity.
  - no_step.
  - assert (P := without_possible (Nat.eqb 2) broken broken_possible).
    apply (two_on_each _ 2 0 0 P); try lia. counts.
Qed.

(* 6. While a loop of another leads there, not all others go on. *)
Theorem not_all_go_on : ~ live_but (Nat.eqb 2) (lines [A0] [B1] [B2; C2]).
Proof.
  intro L. apply (breakdown three_wide 3 three_places _ three_spots three_eq three_closed) in L; [|is_possible].
  destruct L as [A _]. specialize (A 1 B1 1 eq_refl (or_introl eq_refl)). discriminate.
Qed.
Print Assumptions start_is_live.
Print Assumptions ring_is_dead.
Print Assumptions crowd_is_dead.
Print Assumptions turned_is_live.
Print Assumptions others_go_on.
Print Assumptions not_all_go_on.
